"""The words of `--input`."""

from pathlib import Path

import pytest

from devices import DeviceError, ProbePath, RegistrationError
from paravol.inputs import FlightInput, choose_input
from paravol.inputs.pose_completer import HandChannel, PathChannel
from scenarios import Scenario

Exercise = tuple[Scenario, ProbePath]
FILE = Path("examples/first_flight.path.json")


def chosen(
    words: str | None, exercise: Exercise, device: str | None = None
) -> FlightInput:
    scenario, path = exercise
    return choose_input(words, device, scenario, path, FILE)


def test_the_emulated_arm_follows_the_path_and_a_real_one_the_hand(
    exercise: Exercise,
) -> None:
    emulated = chosen("emulator", exercise)
    assert isinstance(emulated.completer, PathChannel)
    assert emulated.until_s == exercise[1].duration_s
    assert emulated.has_instrument
    real = chosen(None, exercise, "/dev/ttyUSB7")
    assert isinstance(real.completer, HandChannel)
    assert real.name == "/dev/ttyUSB7"
    assert real.until_s == float("inf")
    assert not real.has_instrument
    assert real.touch_hint != emulated.touch_hint
    for arm in (emulated, real):
        assert arm.registration is None
        assert arm.controls is None


def test_without_words_or_an_arm_the_mouse_steers(exercise: Exercise) -> None:
    assert chosen(None, exercise).controls is not None
    assert chosen(None, exercise).name == chosen("mouse", exercise).name


def test_a_hand_needs_no_registration_and_takes_keys(exercise: Exercise) -> None:
    mouse = chosen("mouse", exercise)
    assert mouse.controls is not None
    assert mouse.registration is not None
    link = chosen("igtl:localhost:18944:Probe", exercise)
    assert link.name == "OpenIGTLink localhost:18944"
    assert link.registration is not None
    assert link.controls is None


@pytest.mark.parametrize(
    "words",
    [
        *("", "robot", "mouse:1", "emulator:2", "recording", "recording:", "igtl"),
        *("igtl:", "igtl:host", "igtl:host:", "igtl:host:x", "igtl::18944"),
        *("igtl:host:0", "igtl:host:65536", "igtl:host:²", "MOUSE"),
    ],
)
def test_other_words_are_refused_in_one_sentence(
    words: str, exercise: Exercise
) -> None:
    with pytest.raises(ValueError, match="--input"):
        chosen(words, exercise)


def test_what_is_not_there_is_named(exercise: Exercise, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"nothing\.json"):
        chosen(f"recording:{tmp_path / 'nothing.json'}", exercise)
    with pytest.raises(DeviceError, match="event77"):
        chosen(f"gamepad:{tmp_path / 'event77'}", exercise)
    for words in ("mouse", "emulator"):
        with pytest.raises(ValueError, match="--device"):
            chosen(words, exercise, "/dev/ttyUSB0")


def test_a_tracker_may_be_registered_by_file_and_a_mouse_may_not(
    exercise: Exercise, tmp_path: Path
) -> None:
    scenario, path = exercise
    file = tmp_path / "nothing.json"
    with pytest.raises(RegistrationError, match=r"nothing\.json"):
        choose_input("igtl:localhost:18944", None, scenario, path, FILE, file)
    with pytest.raises(ValueError, match="leave it out to fly with 'mouse'"):
        choose_input("mouse", None, scenario, path, FILE, file)
