from typing import Any

import numpy as np
import pytest

from scenarios.metrics import Breach, HazardGaps, Measured, Settings
from scenarios.metrics.hazard import HAZARD, hazard_dose_s
from scenarios.metrics.metric import SCOPE, Found
from tests.scenarios.metrics.tracks import NO_TRACK, of_scope


def approach(gap_mm: np.ndarray, rate_hz: float = 100.0, **more: Any) -> Measured:
    times = np.arange(len(gap_mm)) / rate_hz
    return of_scope(NO_TRACK, hazards=HazardGaps(times, {"orbit": gap_mm}), **more)


def value(name: str, measured: Measured, hazard: str = "orbit") -> Found:
    (found,) = (
        d.answers(measured)[f"{name}: {hazard}"]
        for d in HAZARD
        if d.name == name and d.role in (SCOPE, "patient")
    )
    return found


@pytest.mark.parametrize("rate_hz", [20.0, 100.0, 1000.0])
def test_the_dose_of_a_straight_approach_is_a_triangle(rate_hz: float) -> None:
    """From 6 mm to 0 and back at 3 mm/s, margin 3 mm: 2 x 1/2 x 1 s."""
    t = np.arange(0.0, 4.0 + 0.5 / rate_hz, 1 / rate_hz)
    gap = 3.0 * np.abs(t - 2.0)
    measured = approach(gap, rate_hz)
    assert value("hazard dose", measured).value == pytest.approx(1.0, abs=1e-3)
    near = value("time in margin", measured)
    assert near.value == pytest.approx(2.0, abs=2 / rate_hz)
    assert near.intervals[0] == pytest.approx((1.0, 3.0), abs=2 / rate_hz)
    assert value("smallest distance", measured).value == pytest.approx(0.0, abs=1e-12)


def test_the_dose_grows_inside() -> None:
    """One second 3 mm deep counts twice: 1 - (-3) / 3."""
    times = np.linspace(0, 1, 101)
    assert hazard_dose_s(times, np.full(101, -3.0), 3.0, 0.5) == pytest.approx(2.0)
    assert hazard_dose_s(times, np.full(101, 3.0), 3.0, 0.5) == 0.0


def test_near_misses_are_approaches_without_entry() -> None:
    t = np.arange(0.0, 6.0, 0.01)
    gap = 4.0 + 2.0 * np.cos(2 * np.pi * t)  # 2 mm six times
    gap[300:320] = -0.5  # and once inside, near the fourth
    measured = approach(gap)
    found = value("near misses", measured)
    assert found.value == 6.0
    tremor = approach(gap + 0.09 * (-1.0) ** np.arange(len(t)))
    assert value("near misses", tremor).value == found.value


def test_each_hazard_has_its_margin() -> None:
    gap = np.full(101, 4.0)
    wide = Settings(margins_mm={"orbit": 8.0})
    assert value("time in margin", approach(gap)).value == 0.0
    found = value("time in margin", approach(gap, settings=wide))
    assert found.value == pytest.approx(1.0)
    dose = value("hazard dose", approach(gap, settings=wide)).value
    assert dose == pytest.approx(0.5)


def test_what_is_farther_than_measured_is_not_told() -> None:
    times = np.arange(10) / 100
    gaps = HazardGaps(times, {"orbit": np.full(10, 23.65)}, 23.65)
    found = value("smallest distance", of_scope(NO_TRACK, hazards=gaps))
    assert found.value is None
    assert "nothing came nearer" in found.reason


def test_breaches_are_told_with_their_moments() -> None:
    injuries = (
        Breach(1.5, "orbit", "curette", 0.4),
        Breach(2.5, "orbit", "curette", 0.1),
        Breach(3.0, "skull base", "endoscope", 1.0),
    )
    measured = of_scope(NO_TRACK, breaches=injuries)
    assert value("breaches", measured, "any").value == 3.0
    assert value("breaches", measured).intervals == ((1.5, 1.5), (2.5, 2.5))
    assert value("breaches", of_scope(NO_TRACK, breaches=()), "any").value == 0.0
    assert value("breaches", of_scope(NO_TRACK), "any").value is None
