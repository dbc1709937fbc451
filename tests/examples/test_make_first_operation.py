"""The bundled operation: the ostium is wider afterwards, the lamina is whole."""

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from benchmarks.gallery.gallery_views import operated_samples
from devices import load_probe_path
from paravol.patient import load_phantom
from paravol.sessions.session_setup import build_session, operate_on
from renderers.scene import Volume
from scenarios import load_scenario
from scenarios.operation import Operation
from scenarios.rubrics.population import population_of
from scenarios.scoring import OperationFigures

EXAMPLES = Path(__file__).parents[2] / "examples"
OSTIUM = "maxillary ostium, right"
STEP_MM = 0.25


@pytest.fixture(scope="module")
def operated() -> tuple[Operation, OperationFigures]:
    """Step all samples, without any picture."""
    scenario, folder = load_scenario("first_operation")
    path = load_probe_path(folder / scenario.path)
    patient, operation = operate_on(load_phantom(average=True))
    session = build_session(scenario, patient, np.eye(4), (64, 64), operation)
    for sample in operated_samples(path, scenario.scope.endoscope()):
        session.step(sample)
    figures = session.score().operation
    assert figures is not None
    return operation, figures


def ostium_mm2(distance: Volume, at_mm: NDArray[np.float64]) -> float:
    """Area of the air that surrounds the landmark in its sagittal plane.

    Within 5 mm: farther below, the plane passes through the sinus itself.
    """
    reach = np.arange(-5.0, 5.0 + STEP_MM / 2, STEP_MM)
    y, z = np.meshgrid(reach, reach)
    air = distance.sample(at_mm + np.stack([0 * y, y, z], axis=-1)) < 0.0
    pieces, _ = ndimage.label(air)
    middle = pieces[len(reach) // 2, len(reach) // 2]
    assert middle > 0
    return float((pieces == middle).sum()) * STEP_MM**2


def test_the_natural_ostium_is_wider(
    operated: tuple[Operation, OperationFigures],
) -> None:
    operation, _ = operated
    at = np.asarray(load_phantom(average=True).landmarks[OSTIUM])
    before = ostium_mm2(operation.patient.pristine.distance, at)
    after = ostium_mm2(operation.patient.surface.distance, at)
    assert after > 1.5 * before


def test_the_uncinate_is_taken_and_nothing_is_hurt(
    operated: tuple[Operation, OperationFigures],
) -> None:
    operation, figures = operated
    assert figures.injuries == []
    assert figures.wall_bone_mm3["uncinate process"] > 20.0
    assert "lamina papyracea" not in figures.wall_bone_mm3
    assert figures.removed_mm3["uncinate"] > 100.0
    assert operation.injuries is not None
    assert operation.injuries.approaches["orbit"].gap_mm > 3.0
    # an arm's error and tremor take a tenth
    assert operation.injuries.approaches["nasolacrimal duct"].gap_mm > 0.1
    assert 0.0 < figures.sucked_ml < figures.bled_ml


def test_generated_experts_take_about_as_much(
    operated: tuple[Operation, OperationFigures],
) -> None:
    """They fly the same path; hands whose jaws never closed took a tenth."""
    _, figures = operated
    population = population_of("first_operation")
    assert population is not None
    (experts,) = (group for group in population.groups if group.name == "expert")
    taken = experts.values["patient/tissue removed: in all"].middle
    assert taken == pytest.approx(sum(figures.removed_mm3.values()), rel=0.3)


def test_the_path_is_what_the_script_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(EXAMPLES))
    made = runpy.run_path(str(EXAMPLES / "make_first_operation.py"))
    places = {n: np.asarray(p) for n, p in load_phantom(average=True).landmarks.items()}
    path = load_probe_path(EXAMPLES / "first_operation.path.json")
    tips, buttons = made["instrument"](path.t_s, places)
    # the file has the hand's tremor besides
    assert np.abs(path.instrument_tip_mm - tips).max() < 0.25
    np.testing.assert_array_equal(path.buttons, buttons)
    sys.modules.pop("make_first_flight", None)
