"""Compiled: 1,000 times a second from a device's pose to its force.

Ticks are due at fixed moments of the monotonic clock, so that no error adds up; those
that were missed are left out, never made up for. The loop reads a copy of the tissue of
one generation and edits nothing.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from devices.haptics.kernels.guard_force import guard_force, hear_pose
from paravol.haptics.kernels.machine_clock import (
    MONOTONIC,
    THREAD_CPU,
    now_ns,
    sleep_until,
    wake_exactly,
)
from paravol.haptics.kernels.publishing import counted
from paravol.haptics.loop_record import BIN_NS, BINS
from renderers.simd.atomics import give_back, look
from surgery.kernels.touch_force import DT, FORCE, HAS, Patch, touch_tick

Doubles = NDArray[np.float64]
Longs = NDArray[np.int64]
Records = NDArray[Any]

CPU_EVERY = 64
"""Ticks between two looks at the thread's own clock."""


class Feeling(NamedTuple):
    """What a tick works with: see `surgery.kernels.touch_force.touch_tick`."""

    walls: Doubles
    grounds: Doubles
    balls: Doubles
    settings: Doubles
    state: Doubles
    holes: Doubles
    work: Doubles
    out: Doubles


class Tissue(NamedTuple):
    """Two copies of the tissue.

    begun, published: ``(1,)`` int64, how often one was brought up to date, counted by
    `paravol.haptics.kernels.publishing`; after n times `even` or `odd` is the newest.
    """

    even: Patch
    odd: Patch
    begun: Longs
    published: Longs


@njit(cache=True, nogil=True)
def _place_tip(loop: Any, reading: Any) -> None:
    """Write the tip's pose in the patient."""
    matrix, pose = loop.world_from_device, loop.pose
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(3):
                total += matrix[i, k] * reading.rotation[k, j]
            pose[i, j] = total
        total = matrix[i, 3]
        for k in range(3):
            total += matrix[i, k] * reading.position_mm[k]
        pose[i, 3] = total


@njit(cache=True, nogil=True)
def _feel(loop: Any, tissue: Tissue, feeling: Feeling, number: int) -> bool:
    """Work out the force in the patient's frame; False if a copy changed meanwhile."""
    patch = tissue.even if number % 2 == 0 else tissue.odd
    state, holes = feeling.state, feeling.holes
    before, holes_before = state.copy(), holes.copy()
    touch_tick(
        patch,
        feeling.walls,
        feeling.grounds,
        feeling.balls,
        loop.pose,
        feeling.settings,
        state,
        holes,
        feeling.work,
        feeling.out,
    )
    if counted(tissue.begun) >= number + 2:
        state[:], holes[:, :] = before, holes_before
        return False
    return True


@njit(cache=True, nogil=True)
def _want_force(
    loop: Any, reading: Any, tissue: Tissue, feeling: Feeling, now: int
) -> None:
    """Write the force that tissue has for the device, in its frame, unguarded."""
    if look(loop.is_placed) == 0:
        loop.wanted_n[:] = 0.0
        return
    number = counted(tissue.published)
    _place_tip(loop, reading)
    since = now - loop.last_ns if loop.last_ns > 0 else loop.period_ns
    feeling.settings[DT] = since * 1e-9
    if not _feel(loop, tissue, feeling, number):
        # the force of the last tick holds
        loop.torn += 1
        return
    matrix = loop.world_from_device
    for i in range(3):
        total = 0.0
        for k in range(3):
            total += matrix[k, i] * feeling.out[FORCE + k]
        loop.wanted_n[i] = total


@njit(cache=True, nogil=True)
def _publish(loop: Any, reading: Any, guard: Any, now: int) -> None:
    """Write the newest state for other threads."""
    give_back(loop.number)
    loop.time_ns = now
    loop.fault = guard.fault
    loop.count, loop.buttons = reading.count, reading.buttons
    for i in range(3):
        loop.position_mm[i] = reading.position_mm[i]
        for j in range(3):
            loop.rotation[i, j] = reading.rotation[i, j]
    give_back(loop.number)


@njit(cache=True, nogil=True)
def tick_at(
    read: Any,
    command: Any,
    device: int,
    reading: Records,
    guard: Records,
    loop: Records,
    tissue: Tissue,
    feeling: Feeling,
    now: int,
) -> None:
    """Read the device, work out the force, guard it, command it.

    read, command: C functions, see `devices.haptics.force_port`; device: what they are
    given first. reading, guard, loop: ``(1,)`` of `READING`, `GUARD`, `LOOP`. now: ns.
    """
    status = read(device, np.int64(reading.ctypes.data), now)
    heard, held, own = reading[0], guard[0], loop[0]
    if hear_pose(held, status, heard, now):
        _want_force(own, heard, tissue, feeling, now)
    else:
        # a tool that comes back is felt from where it is then
        feeling.state[HAS] = 0.0
        feeling.out[:] = 0.0
        own.wanted_n[:] = 0.0
    own.force_n[:] = own.wanted_n
    guard_force(held, own.force_n, now)
    command(device, own.force_n[0], own.force_n[1], own.force_n[2], now)
    own.last_ns = now
    own.ticks += 1
    _publish(own, heard, held, now)


@njit(cache=True, nogil=True)
def run_loop(
    read: Any,
    command: Any,
    device: int,
    reading: Records,
    guard: Records,
    loop: Records,
    tissue: Tissue,
    feeling: Feeling,
) -> None:
    """Tick until it is told to stop; leave the device without a force."""
    own = loop[0]
    spec = np.zeros(2, np.int64)
    wake_exactly()
    now = now_ns(MONOTONIC, spec)
    due = now
    while look(own.stop) == 0:
        due += own.period_ns
        if now > due:
            missed = (now - due) // own.period_ns + 1
            own.missed += missed
            due += missed * own.period_ns
        sleep_until(due, spec)
        now = now_ns(MONOTONIC, spec)
        own.late[min(max(now - due, 0) // BIN_NS, BINS - 1)] += 1
        tick_at(read, command, device, reading, guard, loop, tissue, feeling, now)
        began, now = now, now_ns(MONOTONIC, spec)
        own.cost_ns += now - began
        own.dearest_ns = max(own.dearest_ns, now - began)
        if own.ticks % CPU_EVERY == 0:
            own.cpu_ns = now_ns(THREAD_CPU, spec)
    command(device, 0.0, 0.0, 0.0, now_ns(MONOTONIC, spec))


@njit(cache=True, nogil=True)
def copy_state(loop: Records, out: Records) -> None:
    """Copy a loop's newest state, all of one tick, to another record of that kind."""
    own = loop[0]
    while True:
        number = look(own.number)
        out[0] = own
        if number % 2 == 0 and look(own.number) == number:
            return
