"""The force loop's thread: it begins, ticks, tells, and ends."""

import threading
import time

import numpy as np
import pytest

from devices.haptics.force_port import ForceLimits
from devices.haptics.mock_head import HeadFault, MockHead
from paravol.haptics.force_loop import PERIOD_S, ForceLoop, new_feeling
from paravol.haptics.tissue_copies import TissueCopies
from surgery.kernels import touch_force
from tests.paravol.haptics.simulated_loop import ball, floor, place

PATIENCE_S = 20.0


def opened(head: MockHead) -> ForceLoop:
    patient = floor()
    feeling = new_feeling(patient.layers, ball(), head.limits, PERIOD_S)
    return ForceLoop(head, TissueCopies(patient).tissue, feeling)


def until(is_so: object) -> None:
    """Wait for what comes in its own time."""
    assert callable(is_so)
    end = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_a_loop_pushes_back_tells_where_and_leaves_no_thread() -> None:
    before = set(threading.enumerate())
    head = MockHead()
    head.lead(place(2.0), 0.001)
    with opened(head) as loop:
        until(lambda: loop.state.is_measured)
        assert not loop.state.force_n.any()
        loop.place(np.eye(4))
        head.lead(place(-3.0), 0.05)
        until(lambda: loop.state.force_n[2] > 0.2)
        state = loop.state
        assert np.linalg.norm(state.force_n) <= head.limits.force_n
        np.testing.assert_allclose(state.device_from_tip[:3, :3], np.eye(3))
        until(lambda: loop.figures().ticks > 200)
        figures = loop.figures()
        assert 0.0 < figures.tick_us <= figures.dearest_us
        assert figures.late_us[0] <= figures.late_us[1] <= figures.late_us[2]
        assert not figures.faults
        assert len(figures.lines()) == 1
    assert set(threading.enumerate()) <= before
    # the device was left without a force
    assert not head.state["commanded_n"].any()
    loop.close()


def test_an_error_beside_a_loop_ends_it_like_ctrl_c_does() -> None:
    before = set(threading.enumerate())
    with pytest.raises(KeyboardInterrupt), opened(MockHead()):
        raise KeyboardInterrupt
    assert set(threading.enumerate()) <= before


def test_a_device_that_goes_away_is_told() -> None:
    head = MockHead(fault=HeadFault("unplugged", 0.1))
    head.lead(place(2.0), 0.001)
    with opened(head) as loop:
        until(lambda: loop.state.is_away)
        assert not loop.state.is_measured
        told = loop.figures().lines()
    assert "the device is away: 1" in told[1]


def test_the_device_bounds_what_tissue_may_ask_of_it() -> None:
    patient = floor()
    feeling = new_feeling(patient.layers, ball(), ForceLimits(2.5, 800.0, 0.4), 1e-3)
    told = feeling.settings
    assert told[touch_force.MOST_N] == 2.5
    # its damping, 0.4 N s/m, bears half of what its stiffness would allow
    assert told[touch_force.STIFFEST] == pytest.approx(0.4)
    assert told[touch_force.DAMPING] == pytest.approx(4e-4)
