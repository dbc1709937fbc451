"""The process that compiles the renderers: it ends with its user and is needed once."""

import subprocess
from pathlib import Path
from typing import Any

import pytest

from paravol.flight.renderer_compiler import FILES, RendererCompiler

Children = list["subprocess.Popen[bytes]"]


class StopError(Exception):
    """Nobody waits any longer."""


def stop(stage: str, share: float) -> None:
    assert 0.0 <= share < 1.0
    raise StopError


@pytest.fixture
def children(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Children:
    """List the children that are begun, with an empty cache."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    found: Children = []
    begin = subprocess.Popen

    def begun(*words: Any, **options: Any) -> "subprocess.Popen[bytes]":
        found.append(begin(*words, **options))
        return found[-1]

    monkeypatch.setattr(subprocess, "Popen", begun)
    return found


def test_who_leaves_ends_it(tmp_path: Path, children: Children) -> None:
    with RendererCompiler() as compiler:
        (child,) = children
        assert child.poll() is None
        with pytest.raises(StopError):
            compiler.wait(stop)
    assert child.returncode is not None
    assert not (tmp_path / "renderers-are-compiled").exists()


def test_none_is_begun_where_all_is_compiled(
    tmp_path: Path, children: Children
) -> None:
    (tmp_path / "renderers-are-compiled").touch()
    with RendererCompiler() as compiler:
        compiler.wait(stop)
    assert not children


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_it_compiles_and_tells_how_far_it_is(
    tmp_path: Path, children: Children
) -> None:
    shares = []
    with RendererCompiler() as compiler:
        compiler.wait(lambda stage, share: shares.append(share))
    assert len(children) == 1
    assert (tmp_path / "renderers-are-compiled").exists()
    assert shares == sorted(shares)
    assert 0.9 < sum(1 for _ in tmp_path.glob("kernels_*/*.nbc")) / FILES < 1.1
