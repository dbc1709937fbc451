"""An abstract scene is a patient like any other."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from paravol.patient import load_patient, load_scene, no_progress
from paravol.sessions.session_setup import build_session, operate_on
from paravol.snapshots.head_scene import HeadScene
from paravol.snapshots.view_file import SceneHead, load_view, save_view
from paravol.snapshots.view_sources import view_of
from scenarios import FrameState, Sample, Scenario, tip_frame
from scenarios.clearance import Clearance
from scenarios.instrument_state import EMPTY_HAND
from scenarios.scenario import Head
from scenarios.tasks import Status
from scenarios.tasks.task import Follow, Hold, LookTask, Ring
from surgery.edit import CuttingLimits
from surgery.solids import capsule

HOOPS = Scenario("h", "H", head=Head(seed=2, spacing_mm=1.0, scene="hoops"))


def test_a_scenario_gets_its_scene_with_the_same_hash_each_time() -> None:
    patient = load_patient(HOOPS, no_progress)
    assert patient.surface_sha256 == load_scene("hoops", 2, 1.0).surface_sha256
    assert patient.surface_sha256 != load_scene("hoops", 3, 1.0).surface_sha256
    assert patient.way_in is not None
    assert list(patient.positions(("start", "hoop 6"))) == ["start", "hoop 6"]


def test_what_is_touched_has_a_name() -> None:
    patient = load_scene("hoops", 2)
    assert patient.structures is not None
    hoop = patient.landmarks["hoop 3"]
    way = hoop - patient.landmarks["start"]
    aside = np.cross(way, (0.0, 0.0, 1.0))
    wire = hoop + 3.0 * aside / np.linalg.norm(aside)
    assert patient.structures.touched(Clearance(0.0, wire)) == "hoop"
    wall = np.array([0.0, 30.0, -21.5])
    assert patient.structures.touched(Clearance(0.0, wall)) == "wall"


def test_a_view_of_a_scene_is_saved_and_found_again(tmp_path: Path) -> None:
    patient = load_patient(HOOPS, no_progress)
    pose = tip_frame(patient.landmarks["start"], np.array([0.0, 1.0, 0.0]))
    camera = HOOPS.scope.endoscope().camera(pose, 0.0, (64, 64))
    view = view_of(FrameState(camera, pose, np.eye(4), 1.0), HOOPS, patient)
    assert view.head == SceneHead("hoops", 2, 1.0)
    save_view(tmp_path / "a.view.json", view)
    again = load_view(tmp_path / "a.view.json")
    HeadScene.of(again.head, no_progress).demand(again)
    other = msgspec.structs.replace(again, head=SceneHead("hoops", 3, 1.0))
    with pytest.raises(ValueError, match="another head"):
        HeadScene.of(other.head, no_progress).demand(other)


def test_a_wall_can_be_cut() -> None:
    before = load_scene("niches", 2, 1.0)
    patient, operation = operate_on(before)
    wall = np.array([7.0, 3.0, 0.0])
    assert float(patient.surface.distance.sample(wall)) > 0.5
    operated = operation.patient
    edit = operated.carve(capsule(wall, wall, 1.5), CuttingLimits())
    assert edit is not None
    assert float(operated.surface.distance.sample(wall)) < -0.5
    assert operated.books.tissues()["mucosa"] > 1.0
    # the scene itself stays as it was
    assert load_scene("niches", 2, 1.0).surface_sha256 == before.surface_sha256


def test_a_straight_scope_follows_hoops_looks_and_holds_without_a_touch() -> None:
    patient = load_scene("hoops", 4)
    marks = patient.landmarks
    start = marks["start"]
    ways = {
        name: _unit(marks[name] - start) for name in sorted(marks) if name != "start"
    }
    rings = tuple(
        Ring(place=name, axis=tuple(way), radius_mm=3.0) for name, way in ways.items()
    )
    last = rings[-1].place
    assert isinstance(last, str)
    scenario = msgspec.structs.replace(
        HOOPS,
        tasks=(
            Follow(name="hoops", title="", rings=rings),
            LookTask(name="look", title="", place=last, after=("hoops",)),
            Hold(
                name="hold",
                title="",
                place=last,
                radius_mm=8.0,
                still_mm=0.5,
                hold_s=2.0,
                after=("look",),
            ),
        ),
    )
    session = build_session(scenario, patient, np.eye(4), (8, 8))
    tips = []
    for name, way in ways.items():
        deepest = np.linalg.norm(marks[name] - start) + 2.0
        tips += [(start + depth * way, way) for depth in (2.0, deepest, 2.0)]
    tips += [(marks[last] - 6.0 * ways[last], ways[last])] * 40
    for n, (tip, way) in enumerate(tips):
        away = tip - 200.0 * way
        session.step(
            Sample(0.1 * n, tip_frame(tip, way), 0.0, away, way, 0, EMPTY_HAND)
        )
    score = session.score()
    assert {state.name: state.status for state in score.tasks or ()} == dict.fromkeys(
        ("hoops", "look", "hold"), Status.DONE
    )
    assert score.contacts == 0


def _unit(way: NDArray[np.float64]) -> NDArray[np.float64]:
    unit: NDArray[np.float64] = way / np.linalg.norm(way)
    return unit
