"""The adapter to libdhd, at a library of the same functions, which a compiler makes.

Each test loads it in a process of its own: a library stays in a process for good.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from devices.haptics.force_dimension import SDK_FOLDER, WANTED, load_library
from devices.port import DeviceError, DeviceReason

COMPILER = shutil.which("cc")
HERE = Path(__file__).parent
ROOT = HERE.parents[2]

needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler")


def build(folder: Path, source: Path) -> None:
    """Compile a library in the place of libdhd."""
    assert COMPILER is not None
    made = folder / "libdhd.so.3.16.0"
    subprocess.run([COMPILER, "-shared", "-fPIC", "-o", made, source], check=True)


def talk(sdk: Path, **settings: str) -> subprocess.CompletedProcess[str]:
    """Open the device in another process and talk to it."""
    return subprocess.run(
        [sys.executable, "-m", "tests.devices.haptics.dhd_talk"],
        cwd=ROOT,
        env=os.environ | {SDK_FOLDER: str(sdk)} | settings,
        capture_output=True,
        text=True,
        timeout=120,
    )


@pytest.fixture(scope="module")
def sdk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sdk")
    build(folder, HERE / "fake_dhd.c")
    return folder


@needs_compiler
def test_compiled_code_reads_and_pushes_the_device_in_its_units(sdk: Path) -> None:
    done = talk(sdk)
    assert done.returncode == 0, done.stderr
    assert "limit 20" in done.stdout


@needs_compiler
def test_a_library_that_knows_no_limit_gets_a_safe_one(sdk: Path) -> None:
    done = talk(sdk, FAKE_LIMITLESS="1")
    assert done.returncode == 0, done.stderr
    assert "limit 12" in done.stdout


@needs_compiler
@pytest.mark.parametrize(
    ("setting", "sentence"),
    [("FAKE_NONE", "no device found"), ("FAKE_WRISTLESS", "has no wrist")],
)
def test_what_cannot_be_flown_with_is_refused(
    sdk: Path, setting: str, sentence: str
) -> None:
    done = talk(sdk, **{setting: "1"})
    assert done.returncode == 1
    assert sentence in done.stderr


@needs_compiler
def test_a_library_that_lacks_a_function_is_refused_before_it_is_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "old.c"
    source.write_text("int dhdOpen(void) { return 0; }\n", encoding="utf-8")
    build(tmp_path, source)
    monkeypatch.setenv(SDK_FOLDER, str(tmp_path))
    with pytest.raises(DeviceError, match=WANTED[1]) as caught:
        load_library()
    assert caught.value.reason is DeviceReason.UNSUPPORTED_FORMAT


def test_without_the_library_one_sentence_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(SDK_FOLDER, str(tmp_path))
    with pytest.raises(DeviceError, match=f"set {SDK_FOLDER} to its folder") as caught:
        load_library()
    assert caught.value.reason is DeviceReason.NO_PORT


def test_a_file_that_is_no_library_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "libdhd.so").write_text("no library", encoding="utf-8")
    monkeypatch.setenv(SDK_FOLDER, str(tmp_path))
    with pytest.raises(DeviceError, match="cannot be loaded"):
        load_library()
