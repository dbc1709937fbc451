"""Whatever is asked for, the guard lets through what a device may get."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.haptics.force_port import ForceLimits, new_guard
from devices.haptics.force_records import (
    AWAY,
    GONE,
    LYING,
    NEW,
    NO_FAULT,
    NO_FORCE,
    NO_NEWS,
    READING,
    SILENT,
)
from devices.haptics.kernels.guard_force import guard_force, hear_pose
from system import UserError

LIMITS = ForceLimits(3.3, 1000.0)
MS = 10**6
ANY = st.floats(width=64)
RAMP_S = 0.1


class Guarded:
    """A guard, asked tick by tick."""

    def __init__(self) -> None:
        self.guard = new_guard(LIMITS, RAMP_S)
        self.reading = np.zeros(1, READING)
        self.reading["rotation"] = np.eye(3)
        self.now_ns = 10**9

    def ask(self, force: list[float], status: int = NEW) -> NDArray[np.float64]:
        """Ask for a force a millisecond later; give what comes out."""
        self.now_ns += MS
        out = np.array(force)
        hear_pose(self.guard[0], status, self.reading[0], self.now_ns)
        guard_force(self.guard[0], out, self.now_ns)
        return out

    @property
    def fault(self) -> int:
        return int(self.guard["fault"][0])


def warm() -> Guarded:
    """Give a guard behind its ramp."""
    guarded = Guarded()
    for _ in range(round(RAMP_S * 1e3) + 2):
        guarded.ask([0.0, 0.0, 0.0])
    return guarded


@settings(max_examples=200, deadline=None)
@given(st.lists(ANY, min_size=3, max_size=3))
def test_no_force_is_larger_than_the_limit_nor_turned(force: list[float]) -> None:
    guarded = warm()
    out = guarded.ask(force)
    if not all(map(math.isfinite, force)):
        assert guarded.fault == NO_FORCE
        assert not out.any()
        return
    assert math.hypot(*out) <= LIMITS.force_n
    largest = max(map(abs, force))
    if largest <= 1.0:
        np.testing.assert_allclose(out, force, rtol=1e-12, atol=0.0)
    else:
        unit = np.array(force) / largest
        length = float(np.linalg.norm(unit))
        size = min(largest * length, 3.3)
        np.testing.assert_allclose(out, size / length * unit, rtol=1e-9, atol=1e-300)


@settings(max_examples=100, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([NEW, NO_NEWS, GONE]),
            st.lists(ANY, min_size=3, max_size=3),
            st.lists(ANY, min_size=3, max_size=3),
        ),
        max_size=30,
    )
)
def test_over_any_history_a_force_is_within_the_limit_and_zero_in_a_fault(
    history: list[tuple[int, list[float], list[float]]],
) -> None:
    guarded = Guarded()
    heard = -math.inf
    for status, place, force in history:
        guarded.reading["position_mm"] = place
        out = guarded.ask(force, status)
        assert math.hypot(*out) <= LIMITS.force_n
        if status == NEW:
            heard = guarded.now_ns
        if guarded.fault != NO_FAULT or status == GONE or guarded.now_ns - heard > MS:
            assert not out.any()


def test_one_missing_pose_is_borne_and_two_are_none() -> None:
    guarded = warm()
    assert guarded.ask([1.0, 0.0, 0.0])[0] == pytest.approx(1.0)
    assert guarded.ask([1.0, 0.0, 0.0], NO_NEWS)[0] == pytest.approx(1.0)
    # 2 ms after the last pose
    assert not guarded.ask([1.0, 0.0, 0.0], NO_NEWS).any()
    assert guarded.fault == SILENT
    assert not guarded.ask([1.0, 0.0, 0.0], GONE).any()
    assert guarded.fault == AWAY
    assert guarded.guard["faults"][0].tolist() == [0, 1, 1, 0, 0]


def test_a_force_grows_evenly_from_zero_after_a_start_and_after_a_fault() -> None:
    guarded = Guarded()
    for _ in range(2):
        sizes = [guarded.ask([0.0, 2.0, 0.0])[1] for _ in range(121)]
        np.testing.assert_allclose(
            sizes, 2.0 * np.minimum(np.arange(121) / 100.0, 1.0), rtol=1e-9
        )
        guarded.ask([0.0, 2.0, 0.0], GONE)


def test_poses_that_no_hand_makes_are_lies() -> None:
    changes: tuple[dict[str, Any], ...] = (
        {"position_mm": [5.0, 0.0, 0.0]},
        {"position_mm": [math.nan, 0.0, 0.0]},
        {"rotation": np.zeros((3, 3))},
        {"rotation": 2.0 * np.eye(3)},
        {"rotation": np.full((3, 3), math.inf)},
    )
    for change in changes:
        guarded = warm()
        for name, value in change.items():
            guarded.reading[name] = value
        assert not guarded.ask([1.0, 0.0, 0.0]).any()
        assert guarded.fault == LYING
    # a hand in a hurry does not lie
    guarded = warm()
    guarded.reading["position_mm"] = [3.0, 0.0, 0.0]
    assert guarded.ask([1.0, 0.0, 0.0]).any()


def test_a_device_put_elsewhere_is_believed_once_it_stays_there() -> None:
    guarded = warm()
    guarded.reading["position_mm"] = [80.0, 0.0, 0.0]
    assert not guarded.ask([1.0, 0.0, 0.0]).any()
    for _ in range(5):
        out = guarded.ask([1.0, 0.0, 0.0])
    assert guarded.fault == NO_FAULT
    assert 0.0 < out[0] < 0.1


def test_limits_that_are_none_are_refused() -> None:
    for force_n, stiffness_n_m in ((0.0, 1.0), (math.nan, 1.0), (1.0, math.inf)):
        with pytest.raises(UserError, match="must be positive"):
            ForceLimits(force_n, stiffness_n_m)
