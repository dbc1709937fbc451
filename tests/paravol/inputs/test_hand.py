"""Where a hand without an arm holds the scope."""

import numpy as np
import pytest

from devices import ProbePath
from devices.controls.fulcrum import FulcrumControl
from paravol.inputs.hand import LIMITS, MouseInput, nostril_fulcrum
from paravol.patient import PatientScene
from scenarios import Scenario

Exercise = tuple[Scenario, ProbePath]


def test_the_scope_starts_in_the_nostril_of_the_exercise(
    bare_room: PatientScene, exercise: Exercise
) -> None:
    scenario, path = exercise
    with MouseInput(scenario, path).open(bare_room) as source:
        pose = source.read(30.0)
    assert pose.tip_mm == pytest.approx(bare_room.landmarks["nostril, right"])
    # Upright, and into the head: backwards and upwards.
    assert pose.pointing[1] > 0.5
    assert pose.device_from_tip[2, 0] == pytest.approx(0.0, abs=1e-12)


def test_the_left_side_is_entered_when_the_path_does(
    bare_room: PatientScene, exercise: Exercise
) -> None:
    _, path = exercise
    mirror = np.array((-1.0, 1.0, 1.0))
    left = ProbePath(
        name="left",
        t_s=path.t_s,
        tip_mm=path.tip_mm * mirror,
        axis=path.axis * mirror,
        roll_deg=-path.roll_deg,
        instrument_tip_mm=path.instrument_tip_mm * mirror,
        instrument_axis=path.instrument_axis * mirror,
        buttons=path.buttons,
    )
    fulcrum = nostril_fulcrum(bare_room, left)
    assert np.array_equal(fulcrum.pivot_mm, bare_room.landmarks["nostril, left"])
    assert fulcrum.pivot_mm[0] > 0.0


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize(
    "goal",
    [
        "middle meatus",
        "sphenoethmoidal recess",
        "frontal ostium",
        "choana",
        "agger nasi",
    ],
)
def test_the_cone_reaches_every_goal_of_the_nose(
    bare_room: PatientScene, exercise: Exercise, side: str, goal: str
) -> None:
    places = bare_room.landmarks
    pivot = places[f"nostril, {side}"]
    axis = places[f"sphenoethmoidal recess, {side}"] - pivot
    way = places[f"{goal}, {side}"] - pivot
    aside = np.linalg.norm(np.cross(way, axis))
    assert np.degrees(np.arctan2(aside, way @ axis)) < LIMITS.cone_deg
    assert np.linalg.norm(way) < LIMITS.depth_mm[1]


def test_the_control_accepts_the_fulcrum_of_both_sides(
    bare_room: PatientScene, exercise: Exercise
) -> None:
    control = FulcrumControl(nostril_fulcrum(bare_room, exercise[1]), LIMITS)
    assert control.depth_mm == 0.0
