import numpy as np
import pytest

from scenarios.metrics import Contacts, Measured, Settings
from scenarios.metrics.contact import (
    contact_by_structure_s,
    contact_count,
    contact_s,
    deepest_mm,
    nominal_force_n,
    touched_way_mm,
)
from tests.scenarios.metrics.tracks import of_scope, track


def pressed(
    gap_mm: np.ndarray, touched: np.ndarray | None = None, rate_hz: float = 100.0
) -> Measured:
    times = np.arange(len(gap_mm)) / rate_hz
    tips = np.stack([0 * times, 10.0 * times, 0 * times], axis=1)
    codes = np.where(gap_mm < 0.0, 0, -1) if touched is None else touched
    contacts = Contacts(times, gap_mm, codes, ("septum", "turbinate"))
    return of_scope(track(times, tips), contacts=contacts)


def wave(rate_hz: float) -> np.ndarray:
    """Ten dips of 0.5 mm in ten seconds, with a tremor of 0.15 mm at 20 Hz."""
    t = np.arange(0.0, 10.0, 1 / rate_hz)
    gap = 0.5 * np.cos(2 * np.pi * t) + 0.15 * np.sin(2 * np.pi * 20 * t)
    return np.asarray(gap)


@pytest.mark.parametrize("rate_hz", [100.0, 250.0, 1000.0])
def test_a_tremor_makes_no_contacts_of_its_own(rate_hz: float) -> None:
    gap = wave(rate_hz)
    crossings = np.count_nonzero(np.diff((gap < 0).astype(int)) == 1)
    assert crossings > 12  # what counting without hysteresis would give
    assert contact_count(pressed(gap, rate_hz=rate_hz)).value == 10.0


def test_times_depths_and_moments() -> None:
    gap = np.full(301, 1.0)
    gap[100:200] = -0.3
    gap[150] = -0.8
    measured = pressed(gap)
    assert contact_count(measured).intervals == ((1.0, 2.0),)
    assert contact_s(measured, is_share=False).value == pytest.approx(1.0)
    assert contact_s(measured, is_share=True).value == pytest.approx(1 / 3)
    deepest = deepest_mm(measured)
    assert (deepest.value, deepest.intervals) == (0.8, ((1.5, 1.5),))
    assert deepest.reason == ""
    assert touched_way_mm(measured).value == pytest.approx(10.0, abs=0.05)


def test_the_force_is_that_of_a_spring() -> None:
    gap = np.array([1.0, -0.5, 1.0])
    stiff = of_scope(
        pressed(gap).scope,
        contacts=pressed(gap).contacts,
        settings=Settings(stiffness_n_mm=2.0),
    )
    assert nominal_force_n(stiff).value == pytest.approx(1.0)


def test_structures_share_the_time() -> None:
    gap = np.where(np.arange(400) % 200 < 100, -0.2, 0.1)
    codes = np.where(gap < 0, (np.arange(400) >= 200).astype(int), -1)
    measured = pressed(gap, codes)
    found = contact_by_structure_s(measured)
    assert isinstance(found, dict)
    total = contact_s(measured, is_share=False).value
    assert sum(f.value or 0.0 for f in found.values()) == pytest.approx(total)
    # a gap of 0.1 mm closes no contact: it goes on with what was touched last
    assert found["septum"].value == pytest.approx(2.0)


def test_no_contact_has_a_depth_of_zero() -> None:
    measured = pressed(np.ones(50))
    assert contact_count(measured).value == 0.0
    assert deepest_mm(measured).value == 0.0
    assert contact_by_structure_s(measured) == {}


def test_a_head_that_nobody_measured_has_no_contacts() -> None:
    measured = of_scope(pressed(np.ones(9)).scope)
    assert contact_count(measured).value is None
    assert contact_by_structure_s(measured) == {}
