"""The bundled operation: gently, seen, and the ostium comes to light."""

import runpy
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.gallery.gallery_views import operated_samples
from devices import ProbePath, load_probe_path
from paravol.patient import PatientScene, load_patient, no_progress
from paravol.sessions.session_setup import build_session, operate_on
from scenarios import Sample, Session, load_scenario, tip_frame
from scenarios.instrument_state import NO_TOOL
from scenarios.operation import Operation
from scenarios.rubrics.population import population_of
from scenarios.scoring import OperationFigures
from scenarios.tasks import Status
from scenarios.tasks.rules import is_in_sight

EXAMPLES = Path(__file__).parents[2] / "examples"
OSTIUM = "maxillary ostium, right"
MOST_N = 20.0
MOST_MM_S, MOST_DEG_S = 250.0, 400.0
"""Hands that are not hurried; movements of least jerk are 1.9 times as fast as on the
average at their middle."""


@dataclass
class Flown:
    """The bundled operation, stepped without any picture."""

    path: ProbePath
    head: PatientScene
    session: Session
    operation: Operation
    figures: OperationFigures
    samples: list[Sample]
    touched: NDArray[np.bool_]


@pytest.fixture(scope="module")
def flown() -> Flown:
    scenario, folder = load_scenario("first_operation")
    path = load_probe_path(folder / scenario.path)
    head = load_patient(scenario, no_progress)
    patient, operation = operate_on(head)
    session = build_session(scenario, patient, np.eye(4), (64, 64), operation)
    samples = list(operated_samples(path, scenario.scope.endoscope()))
    touched = []
    for sample in samples:
        session.step(sample)
        assert session.placed is not None
        touched.append(session.placed.gap_mm < 0.0)
    figures = session.score().operation
    assert figures is not None
    return Flown(path, head, session, operation, figures, samples, np.array(touched))


def test_all_that_the_exercise_asks_is_done(flown: Flown) -> None:
    assert flown.session.tasks is not None
    assert {s.status for s in flown.session.tasks.ended()} == {Status.DONE}
    assert flown.figures.wall_bone_mm3["uncinate process"] > 20.0
    assert flown.figures.removed_mm3["uncinate"] > 100.0
    assert flown.figures.injected_ml > 0.1


def test_nothing_is_hurt_broken_or_pressed_hard(flown: Flown) -> None:
    figures = flown.figures
    assert figures.injuries == []
    assert figures.broken_walls == {}
    # where the process is grown to it
    assert figures.wall_bone_mm3.get("lamina papyracea", 0.0) < 1.0
    assert figures.greatest_n <= MOST_N
    assert figures.scope_n <= 2.0
    assert figures.bled_ml < 5.0
    assert flown.operation.injuries is not None
    assert flown.operation.injuries.approaches["orbit"].gap_mm > 0.5


def test_the_scope_touches_little_and_sees_the_tool(flown: Flown) -> None:
    assert flown.touched.mean() <= 0.1
    seen = []
    endoscope = load_scenario("first_operation")[0].scope.endoscope()
    half_deg = endoscope.field_of_view_deg / 2
    for sample in flown.samples:
        if sample.instrument.name == NO_TOOL:
            continue
        frame, scope = sample.device_from_tip, endoscope.at(sample.scope_deg)
        forward = scope.frame(frame, sample.roll_deg)[3]
        ahead = sample.instrument_tip_mm - frame[:3, 3]
        cosine = forward @ ahead / np.linalg.norm(ahead)
        seen.append(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))) < half_deg)
    assert np.mean(seen) >= 0.85


def test_the_natural_ostium_comes_to_light(flown: Flown) -> None:
    """From in front the uncinate process hides it; in the end a scope looks into it."""
    ostium = flown.head.landmarks[OSTIUM]
    last = flown.samples[-1]
    eye = last.device_from_tip[:3, 3]
    operated = flown.operation.patient
    assert not is_in_sight(operated.pristine.distance, eye, ostium)
    assert is_in_sight(operated.surface.distance, eye, ostium)
    assert last.scope_deg == 70.0


def test_hands_do_not_jump(flown: Flown) -> None:
    path = flown.path
    step_s = np.diff(path.t_s)
    held = [path.sample(t).tool != NO_TOOL for t in path.t_s.tolist()]
    held = np.array(held)[:-1] & np.array(held)[1:]
    for tips, turns, there in (
        (path.tip_mm, path.roll_deg, np.ones(len(step_s), bool)),
        (path.instrument_tip_mm, path.instrument_roll_deg, held),
    ):
        mm_s = np.linalg.norm(np.diff(tips, axis=0), axis=1) / step_s
        deg_s = np.abs(np.diff(turns)) / step_s
        assert mm_s[there].max() < MOST_MM_S
        assert deg_s[there].max() < MOST_DEG_S


def test_tools_change_outside_the_nose(flown: Flown) -> None:
    """Where a hand is empty or changes tools, nothing is in the nose."""
    for before, after in zip(flown.samples, flown.samples[1:], strict=False):
        if before.instrument.name != after.instrument.name:
            held = before if after.instrument.name == NO_TOOL else after
            tip = held.instrument_tip_mm
            # patient anterior is -y
            assert tip[1] < flown.head.landmarks["nostril, right"][1]


def test_generated_experts_take_about_as_much(flown: Flown) -> None:
    """They fly the same path; hands whose jaws never closed took a tenth."""
    population = population_of("first_operation")
    assert population is not None
    (experts,) = (group for group in population.groups if group.name == "expert")
    taken = experts.values["patient/tissue removed: in all"].middle
    whole = sum(flown.figures.removed_mm3.values())
    assert taken == pytest.approx(whole, rel=0.3)


@pytest.mark.slow
def test_the_path_is_what_the_script_makes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = runpy.run_path(str(EXAMPLES / "make_first_operation.py"))
    # functions of a module that was run look names up in its own
    names = made["main"].__globals__
    monkeypatch.setitem(names, "EXAMPLES", tmp_path)
    made["main"]()
    name = "first_operation.path.json"
    assert (tmp_path / name).read_bytes() == (EXAMPLES / name).read_bytes()


def test_the_first_sample_is_before_the_nose(flown: Flown) -> None:
    first = flown.samples[0]
    frame = tip_frame(first.device_from_tip[:3, 3], -first.device_from_tip[:3, 2])
    np.testing.assert_allclose(frame, first.device_from_tip, atol=1e-9)
    assert first.instrument.name == NO_TOOL
