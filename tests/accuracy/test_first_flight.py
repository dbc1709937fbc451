"""The bundled flight is one a rigid scope can fly."""

import numpy as np
import pytest

from anatomy import PhantomParameters, sinus_phantom
from devices import ProbePath, load_probe_path
from scenarios import Scenario, load_scenario, shaft_clearance, tip_frame
from scenarios.metrics import measure
from scenarios.passing import limited_metrics
from scenarios.rubrics import Verdict
from scenarios.rubrics.exercise_mark import exercise_mark
from tests.scenarios.metrics.tracks import of_scope, track

SHAFT_MM = 110.0
SUCTION_MM = (2.4, 70.0)
"""The tube's diameter and length that the path was planned for."""


@pytest.fixture(scope="module")
def bundled() -> tuple[Scenario, ProbePath]:
    scenario, folder = load_scenario("first_flight")
    return scenario, load_probe_path(folder / scenario.path)


def test_shaft_and_tip_stay_out_of_tissue(bundled: tuple[Scenario, ProbePath]) -> None:
    scenario, path = bundled
    head = scenario.head
    phantom = sinus_phantom(PhantomParameters(seed=head.seed), head.spacing_mm)
    radius = scenario.scope.diameter_mm / 2
    gaps = [
        shaft_clearance(phantom.distance, tip_frame(t, a), radius, SHAFT_MM).gap_mm
        for t, a in zip(path.tip_mm, path.axis, strict=True)
    ]
    # poses come back from the arm within .3 mm; the path itself must be clear
    assert min(gaps) > 0.1
    tube = [
        shaft_clearance(
            phantom.distance, tip_frame(t, a), SUCTION_MM[0] / 2, SUCTION_MM[1]
        ).gap_mm
        for t, a in zip(path.instrument_tip_mm, path.instrument_axis, strict=True)
    ]
    assert min(tube) > 0.1
    # and it is a flight through a nose, not through the open air
    assert sum(gap < 5.0 for gap in gaps) > 0.7 * len(gaps)


def test_it_visits_every_station_in_order(bundled: tuple[Scenario, ProbePath]) -> None:
    scenario, path = bundled
    marks = sinus_phantom(PhantomParameters(seed=1), scenario.head.spacing_mm).landmarks
    last = -1.0
    for name, within_mm in (
        ("nostril, right", 8.0),
        ("inferior turbinate head, right", 8.0),
        ("middle meatus, right", 14.0),
        ("sphenoethmoidal recess, right", 6.0),
        ("nasopharynx", 20.0),
    ):
        distance = np.linalg.norm(path.tip_mm - marks[name].position_mm, axis=1)
        near = path.t_s[(distance < within_mm) & (path.t_s > last)]
        assert len(near), f"{name}: nearest {distance.min():.1f} mm"
        last = float(near[0])
    # It begins and ends before the nostril, so near that the nose fills the picture.
    for end in (0, -1):
        before = marks["nostril, right"].position_mm[1] - path.tip_mm[end, 1]
        assert 5 < before < 10


def test_it_moves_like_a_hand(bundled: tuple[Scenario, ProbePath]) -> None:
    _, path = bundled
    assert path.duration_s == pytest.approx(25.0)
    assert np.allclose(np.diff(path.t_s), 0.01)
    speed = np.linalg.norm(np.diff(path.tip_mm, axis=0), axis=1) / 0.01
    assert speed.max() < 80.0  # mm/s
    # tremor of 8-12 Hz stands above its neighbourhood in the spectrum
    detail = path.tip_mm[:, 2] - np.convolve(
        path.tip_mm[:, 2], np.ones(25) / 25, "same"
    )
    power = np.abs(np.fft.rfft(detail[100:-100] * np.hanning(len(detail) - 200))) ** 2
    hertz = np.fft.rfftfreq(len(detail) - 200, 0.01)
    assert power[(hertz > 7) & (hertz < 13)].max() > 20 * power[hertz > 15].max()


@pytest.mark.parametrize(
    ("is_flown", "verdict"), [(True, Verdict.PASSED), (False, Verdict.NOT_PASSED)]
)
def test_it_passes_and_a_scope_that_is_held_still_does_not(
    bundled: tuple[Scenario, ProbePath], is_flown: bool, verdict: Verdict
) -> None:
    scenario, path = bundled
    phantom = sinus_phantom(PhantomParameters(seed=1), scenario.head.spacing_mm)
    places = {n: phantom.landmarks[n].position_mm for n in scenario.targets}
    tips = path.tip_mm if is_flown else np.broadcast_to(path.tip_mm[0], (2501, 3))
    measured = of_scope(track(path.t_s, tips), targets=places)
    found = measure(measured, chosen=limited_metrics(scenario))
    # a rubric gives full points to whoever touches nothing
    mark = exercise_mark(scenario, (), found, percent=100.0)
    assert mark is not None
    assert mark.verdict is verdict
    assert len(mark.kept if is_flown else mark.missed) == len(scenario.targets) == 4
