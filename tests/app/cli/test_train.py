"""`paravol train` before a window is open: every refusal is one sentence."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageColor

from app.__main__ import main
from app.window.style import READY
from tests.app.window.opened_window import run_script
from tests.paravol.trainee import hoops_flight

Train = Callable[..., tuple[subprocess.CompletedProcess[str], list[int]]]


def refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["train", *words]) == 1
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("paravol: ")
    assert said.err.count("\n") == 1
    return said.err


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--size", "63"], "63"),
        (["--size", "5000"], "5000"),
        (["--seconds", "0"], "--seconds"),
        (["--seconds", "inf"], "--seconds"),
        (["--screenshot", "picture.bmp"], "picture.bmp"),
        (["--screenshot", "no/such/folder/picture.png"], "no/such/folder"),
        (["--scenario", "no_such_thing"], "no_such_thing"),
        (["--input", "robot"], "robot"),
        (["--input", "igtl:here"], "igtl:localhost:18944"),
        (["--input", "recording:no/such.json"], "no/such.json"),
        (["--input", "gamepad:no/such/event0"], "no/such/event0"),
        (["--input", "mouse", "--device", "/dev/ttyUSB0"], "--device"),
        (["--stream-igtl", "everywhere"], "--stream-igtl"),
    ],
)
def test_bad_options_are_named(
    words: list[str],
    named: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # a test before this one may have opened a window
    monkeypatch.delitem(sys.modules, "app.window.main_window", raising=False)
    assert named in refused(words, capsys)
    # and none of it costs the time that loading Qt takes
    assert "app.window.main_window" not in sys.modules


def test_a_recording_is_never_overwritten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "session.json").write_text("mine")
    assert str(tmp_path) in refused(["--record", str(tmp_path)], capsys)
    assert (tmp_path / "session.json").read_text() == "mine"


def test_without_a_display_no_window_opens_and_nothing_crashes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    assert "there is no display" in refused([], capsys)


FELT = """
import sys
from app.__main__ import main
words = "--haptics emulated --size 64 --threads 1 --seconds 1 --sound off".split()
assert main(["train", "--scenario", *sys.argv[1:], *words]) == 0
"""


@pytest.mark.display
@pytest.mark.slow
def test_a_felt_flight_tells_at_its_end_how_the_force_loop_ran(
    screen: str, coarse_scenario: Path, tmp_path: Path
) -> None:
    told = run_script(FELT, coarse_scenario, "--record", tmp_path / "felt.paravol")
    assert "Fly it again" in told
    assert "Force loop: " in told


def test_no_first_picture_waits_for_what_only_later_ones_need() -> None:
    later = (
        "pyvista",
        "matplotlib",
        "scipy.signal",
        "scipy.stats",
        "sqlalchemy",
        "trimesh",
        "SimpleITK",
        "jinja2",
        "devices.haptics.mock_head",
    )
    script = (
        "from paravol.environment import prepare_environment\n"
        "prepare_environment()\n"
        "import sys\n"
        "import app.window.navigator, app.window.main_window\n"
        "import paravol.exercises.training_setup\n"
        f"print([name for name in {later!r} if name in sys.modules])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout == "[]\n"


@pytest.mark.display
@pytest.mark.slow
def test_an_error_in_a_flight_is_told_on_the_page_until_the_window_is_closed(
    train: Train, tmp_path: Path
) -> None:
    shot = tmp_path / "shot.png"
    record = hoops_flight.record(tmp_path / "a.paravol")
    done, left = train(
        *("--scenario", "centring", "--input", f"recording:{record}"),
        *("--seconds", "1", "--screenshot", str(shot)),
    )
    assert done.returncode == 1
    assert done.stderr.startswith(f"paravol: {record} was flown through another head")
    assert done.stderr.count("\n") == 1
    assert not left
    with Image.open(shot) as picture:
        pixels = np.asarray(picture.convert("RGB"), dtype=np.int64)
    # a way to fly again stands in the corner, where a flight's page has none
    corner = pixels[-60:, -150:]
    again = np.abs(corner - np.array(ImageColor.getrgb(READY.name()))).max(axis=-1) < 9
    assert again.mean() > 0.2
