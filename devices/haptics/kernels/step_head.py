"""Compiled: a probe on a motor, held by a hand that leads it by a spring and a damper.

    m a = F_motor - b v + K_h (hand - x) + B_h (v_hand - v) - Coulomb friction

in fixed sub-steps, semi-implicit (velocities first), so that the same commands at the
same moments give the same motion, bit by bit. Friction takes away at most the momentum
that is there: what stands, stands until more than the friction pulls. Commands reach
the motor after a delay and no larger than it can be; encoders count whole quanta.
"""

import math
from typing import Any

import numpy as np
from numba import carray, cfunc, from_dtype, njit, types  # type: ignore[attr-defined]
from numpy.typing import NDArray

from devices.haptics.force_records import (
    GONE,
    HEAD,
    HEALTHY,
    LIAR,
    MOST_DELAY,
    MUTE,
    NEW,
    NO_NEWS,
    READING,
    SATURATED,
    STUCK,
    UNPLUGGED,
)
from renderers.simd.atomics import give_back, look

Doubles = NDArray[np.float64]
Longs = NDArray[np.int64]

WEAK = 0.2
"""Share of its limit that a saturated motor reaches."""

LIE_EVERY, LIE_MM = 8, 25.0
"""A liar's every eighth measurement is off by so much; every second of those is NaN."""

STALL_NS = 100_000_000
"""Nobody is left alone with a force for longer than this: what comes after is left
out, and the probe stands."""

FAR_MM = 30.0
"""A hand that goes farther than this at once has been put elsewhere."""


@njit(cache=True, nogil=True)
def lead_head(
    goal_number: Longs,
    head: Any,
    goal_mm: Doubles,
    rotation: Doubles,
    lasts_ns: int,
    buttons: int,
) -> None:
    """Send the hand to a place, to be reached after some time; for one other thread.

    goal_number: the head's field of that name. goal_mm: ``(3,)``. rotation: ``(3, 3)``.
    """
    give_back(goal_number)
    for i in range(3):
        head.goal_mm[i] = goal_mm[i]
        for j in range(3):
            head.goal_rotation[i, j] = rotation[i, j]
    head.goal_lasts_ns = lasts_ns
    head.goal_buttons = buttons
    give_back(goal_number)


@njit(cache=True, nogil=True)
def _take_goal(head: Any) -> None:
    """Take a new goal, unless it is being written just now."""
    number = look(head.goal_number)
    if number == head.taken_number or number % 2 != 0:
        return
    goal, rotation = np.empty(3), np.empty((3, 3))
    goal[:] = head.goal_mm
    rotation[:, :] = head.goal_rotation
    lasts_ns, buttons = head.goal_lasts_ns, head.goal_buttons
    if look(head.goal_number) != number:
        return
    head.taken_number = number
    squared = 0.0
    for i in range(3):
        squared += (goal[i] - head.to_mm[i]) ** 2
    if not head.is_held or squared > FAR_MM * FAR_MM:
        # nobody walks there: the probe is put down where the hand is
        head.is_held = 1
        head.hand_mm[:] = goal
        head.position_mm[:] = goal
        head.velocity_mm_s[:] = 0.0
        head.rotation[:, :] = rotation
    head.from_mm[:] = head.hand_mm
    head.to_mm[:] = goal
    head.from_rotation[:, :] = head.rotation
    head.to_rotation[:, :] = rotation
    head.goal_ns, head.lasts_ns = head.time_ns, max(lasts_ns, 1)
    head.buttons = buttons


@njit(cache=True, nogil=True)
def _turn(head: Any, share: float) -> None:
    """Turn the probe between the hand's last two directions; keep it a rotation."""
    out = head.rotation
    for i in range(3):
        for j in range(3):
            at, to = head.from_rotation[i, j], head.to_rotation[i, j]
            out[i, j] = to if share >= 1.0 else at + share * (to - at)
    if share >= 1.0:
        return
    # z is the shaft: it keeps its direction, x is made normal to it, y follows
    length = math.sqrt(out[0, 2] ** 2 + out[1, 2] ** 2 + out[2, 2] ** 2)
    if not length > 0.1:
        out[:, :] = head.to_rotation
        return
    for i in range(3):
        out[i, 2] /= length
    along = out[0, 0] * out[0, 2] + out[1, 0] * out[1, 2] + out[2, 0] * out[2, 2]
    for i in range(3):
        out[i, 0] -= along * out[i, 2]
    length = math.sqrt(out[0, 0] ** 2 + out[1, 0] ** 2 + out[2, 0] ** 2)
    if not length > 0.1:
        out[:, :] = head.to_rotation
        return
    for i in range(3):
        out[i, 0] /= length
    out[0, 1] = out[1, 2] * out[2, 0] - out[2, 2] * out[1, 0]
    out[1, 1] = out[2, 2] * out[0, 0] - out[0, 2] * out[2, 0]
    out[2, 1] = out[0, 2] * out[1, 0] - out[1, 2] * out[0, 0]


@njit(cache=True, nogil=True)
def fault_at(head: Any, now_ns: int) -> int:
    """Return what the head suffers from at a moment."""
    since_ns = now_ns - head.began_ns
    if head.fault_from_ns <= since_ns < head.fault_until_ns:
        return int(head.fault)
    return HEALTHY


@njit(cache=True, nogil=True)
def _drive(head: Any) -> None:
    """Put the command that arrives now on the motor, as far as it can push."""
    head.on_the_way_n[head.steps % MOST_DELAY, :] = head.commanded_n
    if head.time_ns - head.commanded_ns > head.watchdog_ns:
        head.on_the_way_n[head.steps % MOST_DELAY, :] = 0.0
    arrives = (head.steps - head.delay_steps) % MOST_DELAY
    head.steps += 1
    if head.steps <= head.delay_steps:
        return
    limit = head.limit_n
    fault = fault_at(head, head.time_ns)
    if fault == SATURATED:
        limit *= WEAK
    if fault == UNPLUGGED:
        limit = 0.0
    x = head.on_the_way_n[arrives, 0]
    y = head.on_the_way_n[arrives, 1]
    z = head.on_the_way_n[arrives, 2]
    size = math.sqrt(x * x + y * y + z * z)
    share = 1.0 if size <= limit else limit / size
    # no number moves no motor
    share = share if math.isfinite(size) else 0.0
    if share == 0.0:
        x = y = z = 0.0
    head.motor_n[0], head.motor_n[1] = share * x, share * y
    head.motor_n[2] = share * z


@njit(cache=True, nogil=True)
def _step(head: Any) -> None:
    """Go on by one sub-step."""
    _drive(head)
    head.time_ns += head.step_ns
    step_s = head.step_ns * 1e-9
    share = min((head.time_ns - head.goal_ns) / head.lasts_ns, 1.0)
    speed = 0.0
    for i in range(3):
        before = head.hand_mm[i]
        head.hand_mm[i] = head.from_mm[i] + share * (head.to_mm[i] - head.from_mm[i])
        hand_m_s = (head.hand_mm[i] - before) * 1e-3 / step_s
        v = head.velocity_mm_s[i] * 1e-3
        pull = head.motor_n[i] - head.viscous_ns_m * v
        pull += head.hand_n_m * (head.hand_mm[i] - head.position_mm[i]) * 1e-3
        pull += head.hand_ns_m * (hand_m_s - v)
        v += step_s * pull / head.mass_kg
        head.velocity_mm_s[i] = 1e3 * v
        speed += v * v
    speed = math.sqrt(speed)
    lost = step_s * head.coulomb_n / head.mass_kg
    left = 0.0 if speed <= lost else 1.0 - lost / speed
    for i in range(3):
        head.velocity_mm_s[i] *= left
        head.position_mm[i] += step_s * head.velocity_mm_s[i]


@njit(cache=True, nogil=True)
def advance_head(head: Any, now_ns: int) -> None:
    """Go on to a moment, in whole sub-steps; what is left is made up next time."""
    if head.began_ns == 0:
        head.began_ns = head.time_ns = head.commanded_ns = now_ns
    _take_goal(head)
    if not head.is_held:
        head.time_ns = now_ns
        return
    if now_ns - head.time_ns > STALL_NS:
        head.time_ns = now_ns
        head.velocity_mm_s[:] = 0.0
    while head.time_ns + head.step_ns <= now_ns:
        _step(head)
    share = min((head.time_ns - head.goal_ns) / head.lasts_ns, 1.0)
    _turn(head, share)


@njit(cache=True, nogil=True)
def _measure(head: Any, reading: Any, fault: int) -> None:
    """Write what the encoders count."""
    head.count += 1
    reading.count = head.count
    reading.buttons = head.buttons
    for i in range(3):
        place = head.position_mm[i]
        if head.quantum_mm > 0.0:
            place = head.quantum_mm * math.floor(place / head.quantum_mm + 0.5)
        reading.position_mm[i] = place
        for j in range(3):
            reading.rotation[i, j] = head.rotation[i, j]
    if fault == STUCK:
        if not head.is_stuck:
            head.stuck_mm[:] = reading.position_mm
        for i in range(3):
            reading.position_mm[i] = head.stuck_mm[i]
    head.is_stuck = fault == STUCK
    if fault == LIAR and head.count % LIE_EVERY == 0:
        off = LIE_MM if head.count % (2 * LIE_EVERY) == 0 else math.nan
        reading.position_mm[head.count // LIE_EVERY % 3] += off


@njit(cache=True, nogil=True)
def read_probe(head: Any, reading: Any, now_ns: int) -> int:
    """Let time pass until now and measure; return `NEW`, `NO_NEWS` or `GONE`.

    head, reading: records `HEAD` and `READING`. Without a hand nothing is measured.
    """
    advance_head(head, now_ns)
    fault = fault_at(head, now_ns)
    if fault == UNPLUGGED:
        return GONE
    if fault == MUTE or not head.is_held:
        return NO_NEWS
    if head.count > 0 and now_ns - head.measured_ns < head.measures_every_ns:
        return NO_NEWS
    head.measured_ns = now_ns
    _measure(head, reading, fault)
    return NEW


@njit(cache=True, nogil=True)
def command_probe(head: Any, x_n: float, y_n: float, z_n: float, now_ns: int) -> int:
    """Ask for a force, N, device frame; return 0, or `GONE` where nobody listens."""
    size = math.sqrt(x_n * x_n + y_n * y_n + z_n * z_n)
    if not size <= head.largest_n:
        head.largest_n = size
    if fault_at(head, now_ns) == UNPLUGGED:
        return GONE
    head.commanded_n[0], head.commanded_n[1], head.commanded_n[2] = x_n, y_n, z_n
    head.commanded_ns = now_ns
    return 0


HEAD_AT: Any = types.CPointer(from_dtype(HEAD))  # type: ignore[no-untyped-call]
READING_AT: Any = types.CPointer(from_dtype(READING))  # type: ignore[no-untyped-call]


@cfunc(types.int32(HEAD_AT, READING_AT, types.int64), cache=True)
def read_head(head: Any, reading: Any, now_ns: int) -> int:
    """Read as `devices.haptics.force_port.ForceDevice` says."""
    return read_probe(carray(head, (1,))[0], carray(reading, (1,))[0], now_ns)


@cfunc(
    types.int32(HEAD_AT, types.float64, types.float64, types.float64, types.int64),
    cache=True,
)
def command_head(head: Any, x_n: float, y_n: float, z_n: float, now_ns: int) -> int:
    """Command as `devices.haptics.force_port.ForceDevice` says."""
    return command_probe(carray(head, (1,))[0], x_n, y_n, z_n, now_ns)
