"""The ticks of the force loop, in simulated time."""

import numpy as np
import pytest

from devices.haptics.force_records import HEAD_FAULTS, NO_FAULT
from devices.haptics.mock_head import HeadFault
from paravol.haptics.kernels.publishing import count_one
from paravol.haptics.kernels.run_loop import copy_state
from paravol.haptics.loop_record import LOOP
from tests.paravol.haptics.simulated_loop import PERIOD_NS, SimulatedLoop

TURN = np.array(
    [
        [0.0, 0.0, 1.0, 30.0],
        [1.0, 0.0, 0.0, -20.0],
        [0.0, 1.0, 0.0, 5.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


def pressed(loop: SimulatedLoop, height_mm: float = -3.0) -> SimulatedLoop:
    loop.lead(2.0, 0.001)
    loop.tick(400)
    loop.lead(height_mm, 0.2)
    loop.tick(1500)
    return loop


def test_in_the_air_there_is_no_force_and_on_tissue_the_springs_balance() -> None:
    loop = pressed(SimulatedLoop())
    assert not loop.sizes[:400].any()
    model = loop.model
    wanted = 1e-3 * model.hand_n_m * (3.0 + loop.heights[-1])
    assert loop.sizes[-1] == pytest.approx(wanted, abs=model.coulomb_n + 0.02)
    assert loop.forces[-1][2] == pytest.approx(loop.sizes[-1], rel=1e-6)
    assert np.ptp(loop.heights[-300:]) < 0.01


def test_the_force_is_turned_into_the_devices_frame() -> None:
    straight, turned = SimulatedLoop(), SimulatedLoop(world_from_device=TURN)
    pressed(straight)
    pressed(turned)
    assert turned.sizes[-1] == pytest.approx(straight.sizes[-1], rel=0.02)
    back = TURN[:3, :3] @ turned.forces[-1]
    np.testing.assert_allclose(back / turned.sizes[-1], [0, 0, 1], atol=1e-6)


def test_the_same_ticks_give_the_same_forces_and_edit_nothing() -> None:
    loops = []
    for _ in range(2):
        loop = SimulatedLoop()
        before = loop.patient.hash()
        pressed(loop)
        assert loop.patient.hash() == before
        assert loop.patient.generation == 0
        loops.append(loop)
    assert np.array_equal(loops[0].forces, loops[1].forces)


def test_before_it_is_placed_a_device_is_not_pushed() -> None:
    loop = SimulatedLoop()
    loop.loop["is_placed"] = 0
    pressed(loop)
    assert not loop.sizes.any()
    assert loop.heights[-1] == pytest.approx(-3.0, abs=0.3)


@pytest.mark.parametrize("name", HEAD_FAULTS[1:])
def test_every_fault_keeps_the_limit_and_the_force_comes_back(name: str) -> None:
    loop = SimulatedLoop(fault=HeadFault(name, 1.0, 0.2))
    pressed(loop, -20.0)
    limit = loop.model.limit_n
    assert loop.sizes.max() <= limit
    assert loop.head.state["largest_n"][0] <= limit
    faults = np.array(loop.faults)
    assert not loop.sizes[faults != NO_FAULT].any()
    if name in ("silent", "unplugged"):
        # the last pose was that of tick 999
        assert not loop.sizes[1001:1200].any()
        assert loop.sizes[1199 + 10] <= limit * 10 / 250
    assert np.isfinite(loop.sizes).all()
    # a tool that is back deep inside tissue is felt only once it is out
    loop.lead(2.0, 0.2)
    loop.tick(500)
    loop.lead(-3.0, 0.2)
    loop.tick(500)
    assert loop.sizes.max() <= limit
    assert loop.sizes[-1] > 0.5


@pytest.mark.parametrize(
    "periods", [[1.0], [0.8, 1.2], [1.0] * 40 + [5.0], [1.0] * 30 + [0.2] * 10 + [8.0]]
)
def test_late_ticks_neither_break_the_limit_nor_make_it_swing_more(
    periods: list[float],
) -> None:
    loop = SimulatedLoop()
    loop.lead(2.0, 0.001)
    loop.tick(50)
    loop.lead(-3.0, 0.2)
    for number in range(1500):
        loop.tick(1, round(periods[number % len(periods)] * PERIOD_NS))
    assert loop.sizes.max() <= loop.model.limit_n
    early = np.ptp(loop.heights[-1000:-500])
    assert np.ptp(loop.heights[-500:]) <= early + 0.05


def test_a_tick_whose_copy_changed_under_it_holds_its_force_and_forgets_itself() -> (
    None
):
    loop = pressed(SimulatedLoop())
    feeling, tissue = loop.arguments.feeling, loop.arguments.tissue
    held, state = loop.forces[-1].copy(), feeling.state.copy()
    # as if two copies were begun meanwhile
    tissue.begun[0] -= 2
    loop.tick()
    assert loop.loop["torn"][0] == 1
    np.testing.assert_array_equal(loop.forces[-1], held)
    np.testing.assert_array_equal(feeling.state, state)
    tissue.begun[0] += 2
    loop.tick()
    assert loop.loop["torn"][0] == 1


def test_what_is_told_is_all_of_one_tick() -> None:
    loop = pressed(SimulatedLoop())
    out = np.zeros(1, LOOP)
    copy_state(loop.loop, out)
    np.testing.assert_array_equal(out["force_n"][0], loop.forces[-1])
    assert out["count"][0] == loop.head.state["count"][0]


def test_a_count_is_seen_after_it() -> None:
    counter = np.zeros(1, np.int64)
    assert [count_one(counter) for _ in range(3)] == [1, 2, 3]
