"""The trial of OpenGL: whatever is missing, this process lives and is told."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import pytest

from app import opengl
from app.opengl import (
    OFFSCREEN_LIBRARIES,
    WINDOW_LIBRARIES,
    OpenGL,
    display_name,
    probe_offscreen,
    probe_window,
)

linux_only = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="displays are found by Linux's names"
)


@pytest.fixture
def no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def no_graphics(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Put empty files before the system's graphics libraries: none can be loaded."""
    for name in WINDOW_LIBRARIES | OFFSCREEN_LIBRARIES:
        (tmp_path / name).touch()
    monkeypatch.setenv("LD_LIBRARY_PATH", str(tmp_path))


@pytest.mark.parametrize(
    ("renderer", "is_software"),
    [
        ("llvmpipe (LLVM 15.0.6, 256 bits)", True),
        ("softpipe", True),
        ("Google SwiftShader", True),
        ("NVIDIA GeForce RTX 4070/PCIe/SSE2", False),
        ("Mesa Intel(R) UHD Graphics 620 (KBL GT2)", False),
    ],
)
def test_software_is_known_by_its_name(renderer: str, is_software: bool) -> None:
    assert OpenGL(renderer=renderer).is_software == is_software


@linux_only
@pytest.mark.usefixtures("no_display")
def test_without_a_display_a_window_is_impossible() -> None:
    assert display_name() is None
    found = probe_window()
    assert not found.works
    assert "there is no display" in found.problem
    assert "demo" in found.problem


@linux_only
@pytest.mark.usefixtures("no_display")
def test_a_display_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":4093")
    found = probe_window()
    assert not found.works
    # on a machine without the libraries these come first
    assert ":4093 cannot be reached" in found.problem or found.packages


@linux_only
@pytest.mark.usefixtures("no_display", "no_graphics")
def test_missing_libraries_are_told_as_debian_packages(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("DISPLAY", ":4093")
    found = probe_window()
    assert not found.works
    assert set(found.packages) == set(WINDOW_LIBRARIES.values())
    assert all(package in found.problem for package in found.packages)
    assert "\n" not in found.problem


@linux_only
@pytest.mark.usefixtures("no_display", "no_graphics")
def test_vtk_without_opengl_ends_a_child_and_not_this_process() -> None:
    found = probe_offscreen()
    assert not found.works
    assert found.packages == ("libegl1",)
    assert "signal" in found.problem


@linux_only
def test_a_window_that_died_is_tried_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was found is remembered while no window is open, and only then."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    tried = []

    @contextmanager
    def trial() -> Iterator[Callable[[], OpenGL]]:
        tried.append(1)
        yield lambda: OpenGL(renderer="softpipe")

    monkeypatch.setattr(opengl, "window_trial", trial)
    for windows in (1, 2):
        with opengl.remembered_trial() as answer:
            assert answer().renderer == "softpipe"
        assert len(tried) == 1, windows
    with pytest.raises(KeyboardInterrupt), opengl.remembered_trial():
        raise KeyboardInterrupt
    with opengl.remembered_trial() as answer:
        assert answer().works
    assert len(tried) == 2
    monkeypatch.setenv("QT_QPA_PLATFORM", "minimal")
    with opengl.remembered_trial():
        assert len(tried) == 3


@linux_only
def test_what_does_not_work_is_not_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(
        opengl, "window_trial", lambda: nullcontext(lambda: OpenGL(problem="none"))
    )
    for _ in range(2):
        with opengl.remembered_trial() as answer:
            assert not answer().works
    assert not list(tmp_path.rglob("*.json"))
