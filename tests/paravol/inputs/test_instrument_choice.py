"""The words of `--instrument`, and what goes with the scope's device."""

from pathlib import Path

import numpy as np
import pytest

from devices import DeviceError, ProbePath
from paravol.inputs.instrument_choice import choose_instrument
from paravol.inputs.instrument_input import PlacedPoses
from paravol.patient import PatientScene
from scenarios import Scenario
from scenarios.nostril import BELOW_MM
from tests.paravol.inputs.test_second_device import Scripted, pose

Exercise = tuple[Scenario, ProbePath]


@pytest.mark.parametrize(
    ("words", "scope", "device", "said"),
    [
        ("mouse", None, None, "One mouse"),
        ("mouse", "mouse", None, "One mouse"),
        ("gamepad:2", "gamepad:2", None, "gamepad of the scope"),
        ("gamepad:1", "gamepad", None, "gamepad of the scope"),
        ("igtl:a:1:T", "igtl:a:1:T", None, "moves the scope already"),
        ("arm:/dev/a", None, "/dev/a", "moves the scope already"),
        ("arm:/dev/b", None, "/dev/a", "--instrument-registration"),
        ("robot", None, "/dev/a", "--instrument must be"),
        ("mouse:1", None, "/dev/a", "--instrument must be"),
        ("igtl:a", None, "/dev/a", "--instrument igtl needs HOST:PORT"),
        ("recording:", None, "/dev/a", "--instrument must be"),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(
    words: str, scope: str | None, device: str | None, said: str, exercise: Exercise
) -> None:
    with pytest.raises(ValueError, match=said):
        choose_instrument(words, scope, device, *exercise)


def test_a_side_is_for_what_is_steered(exercise: Exercise) -> None:
    for words, side in (("mouse", "up"), ("igtl:a:1", "left")):
        with pytest.raises(ValueError, match="--instrument-side"):
            choose_instrument(words, None, "/dev/a", *exercise, side=side)
    with pytest.raises(ValueError, match="--instrument-registration"):
        choose_instrument("mouse", None, "/dev/a", *exercise, Path("a.json"))
    with pytest.raises(DeviceError, match="event77"):
        choose_instrument("gamepad:/dev/event77", None, None, *exercise)


@pytest.mark.parametrize("side", [None, "right", "left"])
def test_a_steered_tool_begins_below_the_scope_in_its_nostril(
    side: str | None, bare_room: PatientScene, exercise: Exercise
) -> None:
    tool = choose_instrument("mouse", "emulator", None, *exercise, side=side)
    assert tool.controls is not None
    middle = bare_room.landmarks[f"nostril, {side or 'right'}"]
    with tool.open(bare_room):
        assert tool.hold is not None
    control_at = tool.hold._hold.pivot_mm
    assert np.linalg.norm(control_at - middle) == pytest.approx(BELOW_MM)
    assert control_at[2] < middle[2]


def test_a_recording_without_a_tool_is_refused(
    exercise: Exercise, tmp_path: Path
) -> None:
    file = tmp_path / "nothing.json"
    with pytest.raises(ValueError, match=r"nothing\.json"):
        choose_instrument(f"recording:{file}", "mouse", None, *exercise)


def test_poses_are_placed_at_the_calibrated_tip() -> None:
    source = Scripted()
    source.next = [pose(0.5)]
    matrix = np.eye(4)
    matrix[:3, 3] = (1.0, 2.0, 3.0)
    [placed] = PlacedPoses(source, matrix, np.array([0.0, 0.0, -14.0])).drain()
    assert placed.device_from_tip[:3, 3] == pytest.approx([51.0, 2.0, -11.0])
