"""One tick of the force that tissue returns to a tool: arrays and numbers in and out.

A rigid proxy (Ruspini, Kolarov and Khatib 1997) of the whole tool, as balls, follows
the hand with its orientation and stays out of tissue. A spring joins the two. Its
stiffness is that of the tissue touched: mucosa until it is pressed together, then the
bone or the ground beneath. Friction keeps the proxy within a cone (Harwin and Melder
2002). A wall gives in when the force on it exceeds what its bone bears at that place;
from then on the tool has a hole there. Nothing is allocated and nothing edited, so that
a loop of 1 kHz can call it beside whoever cuts.

Lengths are mm, forces N, times s, so stiffness is N/mm and damping N s/mm.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surgery.kernels.distance_field import (
    HOLE,
    OFF_GRID_MM,
    DistanceField,
    affine,
    free_at,
    free_mm,
    lerp,
    slope,
    spacing_of,
    to_voxel_inside,
)
from surgery.kernels.touches import AT, BALL, GAP, OUTWARD, PUSH, TOUCH, WALL, row_for

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]
Doubles = NDArray[np.float64]


class Patch(NamedTuple):
    """What a tick reads of a patient, all on one grid and contiguous.

    distance: float32, the carved air distance, mm, negative in air; a loop beside who
    edits reads a copy. voxel: ``(3, 4)`` voxels from patient mm. pristine, wall,
    ground: as in `surgery.patient`; they never change.
    """

    distance: Floats
    voxel: Doubles
    pristine: Floats
    wall: Bytes
    ground: Bytes


MUCOSA_MM, BONE_MM, SOFT, HARD, FRICTION, VISCOUS, BREAK_N, FEEL = range(8)
"""Columns of the table of walls, ``(256, FEEL)`` float64, by `Patch.wall`: thicknesses
of mucosa and bone; stiffness of both; friction; damping; force that breaks the bone, 0
where nothing does. The table of grounds is ``(256,)``, stiffness by `Patch.ground`."""

DT, PERIOD, STIFFEST, DAMPING, MOST_N, PULL_N, PULL_BALL, SETTINGS = range(8)
"""Entries of the settings: time since the last tick and what it should be; the largest
stiffness that a device bears; its own damping (0: no damping of tissue is added); the
largest force that it is told; suction's pull and the ball that sucks."""

HAS, PROXY, HAND, LENGTH, RATE, SCALE, BROKEN, STATE = 0, 1, 4, 7, 8, 9, 10, 11
"""Entries of the state, zeros at first: 1 with a proxy; its origin (3); the hand's (3);
the spring's length and its filtered rate; share of the stiffness after a late tick;
walls broken so far."""

MOST_HOLES = 8
HOLES = MOST_HOLES, HOLE
"""Shape of the holes. The oldest is forgotten first, of `state[BROKEN]`."""

FORCE, TORQUE, DEPTH, TISSUE_N, ROW, PLACE, SLOPE, BROKE, PASSES, OUT = (
    *(0, 3, 6, 7, 8, 9, 12, 13, 14, 15),
)
"""Entries of the result: force (3) and torque about the tool's origin (3, N mm) for the
device; the spring's length; the force by the tissue's own stiffness; row of the wall
touched, -1 for none; the place (3); stiffness that the device is told; row of the wall
that broke in this tick, -1 for none; passes over the walls."""

TOUCHING, BURIED, FAULT, LATE, CLIPPED, SEATED = 1, 2, 4, 8, 16, 32
"""Flags: in contact; told no force, because the tool began inside tissue; a pose or a
time that is none; a late tick; force clipped; the proxy was set anew."""

MOST_TOUCHES, MOST_PASSES, SWEEPS = 12, 10, 30
"""Walls that push at the same time; passes over the walls; times that their pushes are
reconciled in each."""

WORK, BEHIND = TOUCH, MOST_TOUCHES + 5
"""Columns of the work space, ``(balls + BEHIND, WORK)`` float64, and its rows after
those of the balls: walls that push, and five vectors."""

JUMP_MM = 20.0
"""No hand moves so far in a tick: the proxy is set anew."""

SEAT_MM = 1.0
"""A tool that is deeper in tissue when it comes has no force until it is out."""

STEP_MM = 0.25
"""Longest way of the proxy along a wall before it is looked at anew."""

SETTLED_MM = 5e-5
"""Shorter ways of the proxy are none: a ten-thousandth of a stiff wall's newton."""

STEEPEST = 1.3
"""An interpolated distance changes by no more than this per mm."""

GIVE = 5e-4
"""Walls that contradict each other share what is lacking: mm per mm of the spring. The
proxy stays so much of the spring's length inside."""

PRESSED = 0.7
"""Share of its thickness by which mucosa before something harder is pressed together;
tissue is shown to give way as much (`surgery.pushing.BESIDE_BONE`)."""

RAMP_MM = 0.1
"""Bone that is cut thinner than this is felt less and less."""

SCATTER, CELL_MM = 0.3, 3.0
"""Breaking forces differ by this share from place to place, between cells so large."""

RIM_MM = 0.3
"""A hole is so much wider than the tool."""

THROUGH_MM, MARCH_MM = 8.0, 0.25
"""So far behind a broken wall the next air is looked for, in such steps."""

FILTER_S, RECOVER_S = 0.003, 0.02
"""Time constant of the rate that damping uses; time in which the whole stiffness comes
back after a late tick."""

LATE_SHARE = 1.5

PULL_MM = 1.0
"""Suction pulls towards tissue that is nearer than this."""


@njit(cache=True, nogil=True, error_model="numpy")
def _outward(field: DistanceField, row: Doubles) -> bool:
    """Write the unit direction into the air at a wall's place; False for none."""
    out = row[OUTWARD : OUTWARD + 3]
    total = slope(field, row[AT], row[AT + 1], row[AT + 2], out)
    if total == 0.0:
        return False
    total = 1.0 / math.sqrt(total)
    for c in range(3):
        out[c] *= total
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _gather(
    field: DistanceField, work: Doubles, near: int, shift: Doubles, reach: float
) -> int:
    """Write the walls that the tool may meet within reach; returns their number.

    The first rows of `work` are the balls that are near: place without the shift,
    radius, gap. Walls follow after all balls, of `surgery.kernels.touches`.
    """
    begin = work.shape[0] - BEHIND
    touches = work[begin : begin + MOST_TOUCHES]
    found = 0
    for n in range(near):
        gap = work[n, 4]
        if gap > reach:
            continue
        at = row_for(touches, found, gap)
        if at < 0:
            continue
        row = touches[at]
        row[BALL], row[GAP] = n, gap
        for c in range(3):
            row[AT + c] = work[n, c] + shift[c]
        row[PUSH] = 0.0
        found = max(found, at + 1)
    kept = 0
    for k in range(found):
        if _outward(field, touches[k]):
            if kept != k:
                touches[kept] = touches[k]
            kept += 1
    return kept


@njit(cache=True, nogil=True, error_model="numpy")
def _push_apart(work: Doubles, found: int, way: Doubles) -> None:
    """Change a way as little as possible so that no wall is entered.

    Projected Gauss-Seidel: walls push and never pull. The pushes stay with the walls.
    """
    begin = work.shape[0] - BEHIND
    for _ in range(SWEEPS):
        most = 0.0
        for k in range(found):
            row = work[begin + k]
            speed = row[5] * way[0] + row[6] * way[1] + row[7] * way[2]
            # out of a wall no faster than its direction is known
            lacking = min(-row[GAP], STEP_MM) - speed - GIVE * row[PUSH]
            push = max(row[PUSH] + lacking / (1.0 + GIVE), 0.0)
            change = push - row[PUSH]
            if change == 0.0:
                continue
            row[PUSH] = push
            most = max(most, abs(change))
            for c in range(3):
                way[c] += change * row[OUTWARD + c]
        if most < SETTLED_MM:
            break


@njit(cache=True, nogil=True, error_model="numpy")
def _update_gaps(
    field: DistanceField, work: Doubles, near: int, shift: Doubles, moved: float
) -> float:
    """Write the gaps of balls that are near; returns the least one.

    moved: how far they went since they were written. A ball that cannot have come
    near is not looked at: its gap is then a bound from below.
    """
    distance, m, _, holes = field
    least = OFF_GRID_MM
    for n in range(near):
        gap = work[n, 4] - STEEPEST * moved
        if gap < 2.0 * STEP_MM:
            x, y, z = work[n, 0], work[n, 1], work[n, 2]
            gap = free_at(distance, m, holes, x + shift[0], y + shift[1], z + shift[2])
            gap -= work[n, 3]
        work[n, 4] = gap
        least = min(least, gap)
    return least


@njit(cache=True, nogil=True, error_model="numpy")
def place_balls(
    field: DistanceField, balls: Doubles, pose: Doubles, shift: Doubles, reach: float,
    work: Doubles,
) -> tuple[int, float]:  # fmt: skip
    """Write the balls that can touch anything within reach; also the least gap."""
    distance, m, _, holes = field
    near, least = 0, OFF_GRID_MM
    for n in range(balls.shape[0]):
        row = work[near]
        x, y, z = affine(pose, balls[n, 0], balls[n, 1], balls[n, 2])
        gap = free_at(distance, m, holes, x + shift[0], y + shift[1], z + shift[2])
        gap -= balls[n, 3]
        least = min(least, gap)
        if gap < reach:
            row[0], row[1], row[2], row[3], row[4] = x, y, z, balls[n, 3], gap
            near += 1
    return near, least


@njit(cache=True, nogil=True, error_model="numpy")
def _follow_hand(
    field: DistanceField, work: Doubles, near: int, shift: Doubles, way: Doubles
) -> tuple[int, int]:
    """Bring the proxy as near to the hand as walls let it; walls and passes.

    shift: ``(3,)`` from the hand to the proxy, changed in place.
    """
    found = 0
    for done in range(MOST_PASSES):
        length = 0.0
        for c in range(3):
            way[c] = -shift[c]
            length += way[c] * way[c]
        length = math.sqrt(length)
        reach = min(length, STEP_MM) + STEP_MM
        found = _gather(field, work, near, shift, reach)
        _push_apart(work, found, way)
        length = math.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
        if length < SETTLED_MM:
            return found, done + 1
        # along walls a short way; in the open as far as nothing can be met
        free = OFF_GRID_MM
        for n in range(near):
            free = min(free, work[n, 4])
        share = min(1.0, max(free, STEP_MM) / length)
        for c in range(3):
            shift[c] += share * way[c]
        _update_gaps(field, work, near, shift, share * length)
    return found, MOST_PASSES


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def scatter_of(row: int, x: float, y: float, z: float) -> float:
    """Return the factor on a wall's breaking force at a place: 1 +- `SCATTER`.

    Hashed from the place, so that every tool and every replay finds it again.
    """
    i = math.floor(x / CELL_MM)
    j = math.floor(y / CELL_MM)
    k = math.floor(z / CELL_MM)
    n = np.uint32(
        (i * 374761393 + j * 668265263 + k * 2147483647 + row * 974711) & 0xFFFFFFFF
    )
    n = np.uint32(((n ^ (n >> np.uint32(13))) * np.uint32(1274126177)) & 0xFFFFFFFF)
    n = n ^ (n >> np.uint32(16))
    return 1.0 + SCATTER * (float(n & np.uint32(0xFFFF)) / 32767.5 - 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _feel_at(
    patch: Patch, walls: Doubles, grounds: Doubles,
    x: float, y: float, z: float, below: float, feel: Doubles,
) -> int:  # fmt: skip
    """Write how tissue feels at a place of its surface; returns the wall there.

    below: so far it lies below the surface, mm, where a thin wall yields as a whole.
    feel: mm by which its mucosa gives way, stiffness until and after that, friction,
    damping, share of the bone that is left. Averaged over the eight voxels around: no
    step between two walls.
    """
    nz, ny, nx = patch.pristine.shape
    u, v, w = to_voxel_inside(patch.pristine.shape, patch.voxel, x, y, z)
    depth = max(lerp(patch.pristine, u, v, w) - below, 0.0)
    i, j, k = min(int(u), nx - 2), min(int(v), ny - 2), min(int(w), nz - 2)
    u, v, w = u - i, v - j, w - k
    for c in range(6):
        feel[c] = 0.0
    most, nearest = -1.0, 0
    for corner in range(8):
        a, b, c = corner & 1, corner >> 1 & 1, corner >> 2
        weight = (u if a else 1 - u) * (v if b else 1 - v) * (w if c else 1 - w)
        row = patch.wall[k + c, j + b, i + a]
        wall = walls[row]
        under = grounds[patch.ground[k + c, j + b, i + a]]
        mucosa = max(wall[MUCOSA_MM] - depth, 0.0)
        bone = wall[MUCOSA_MM] + wall[BONE_MM] - max(depth, wall[MUCOSA_MM])
        bone = max(bone, 0.0)
        share = min(bone / RAMP_MM, 1.0)
        hard = under + share * (wall[HARD] - under)
        feel[0] += weight * PRESSED * mucosa
        feel[1] += weight * (wall[SOFT] if wall[MUCOSA_MM] > 0.0 else under)
        feel[2] += weight * hard
        feel[3] += weight * wall[FRICTION]
        feel[4] += weight * wall[VISCOUS]
        if weight > most:
            most, nearest = weight, row
            feel[5] = bone / wall[BONE_MM] if wall[BONE_MM] > 0.0 else 0.0
    return nearest


@njit(cache=True, nogil=True, error_model="numpy")
def _break(
    field: DistanceField, walls: Doubles, row: int, touch: Doubles, radius: float,
    widest: float, state: Doubles, holes: Doubles,
) -> None:  # fmt: skip
    """Give the tool a hole through a wall.

    It reaches to the next air behind the wall, or a little beyond its bone.
    """
    x = touch[2] - radius * touch[5]
    y = touch[3] - radius * touch[6]
    z = touch[4] - radius * touch[7]
    length = walls[row, MUCOSA_MM] + walls[row, BONE_MM] + MARCH_MM
    is_through = False
    for step in range(int(THROUGH_MM / MARCH_MM)):
        way = (step + 1) * MARCH_MM
        air = free_mm(field, x - way * touch[5], y - way * touch[6], z - way * touch[7])
        # a thin wall's ridge is cut off: nothing of it may be positive in between
        if air >= 0.0:
            length, is_through = way, True
            break
    hole = holes[int(state[BROKEN]) % MOST_HOLES]
    wide = widest + RIM_MM
    length += wide if is_through else 0.0
    hole[0] = x + wide * touch[5]
    hole[1] = y + wide * touch[6]
    hole[2] = z + wide * touch[7]
    hole[3] = x - length * touch[5]
    hole[4] = y - length * touch[6]
    hole[5] = z - length * touch[7]
    hole[6], hole[7] = wide, row
    state[BROKEN] += 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _keep_in_cone(
    field: DistanceField, work: Doubles, near: int, shift: Doubles, start: Doubles,
    friction: float, way: Doubles,
) -> None:  # fmt: skip
    """Let the proxy stay where it was, as far as friction holds it there.

    start: ``(3,)`` shift that leaves the proxy where it was. On a round wall the
    straight way back leads into it; it is pushed out then.
    """
    pressed = math.sqrt(shift[0] ** 2 + shift[1] ** 2 + shift[2] ** 2)
    if pressed < SETTLED_MM:
        return
    # along the wall alone: nothing holds a proxy that is still off it
    off = 0.0
    for c in range(3):
        way[c] = start[c] - shift[c]
        off += way[c] * shift[c] / pressed
    back = 0.0
    for c in range(3):
        way[c] -= off * shift[c] / pressed
        back += way[c] * way[c]
    back = math.sqrt(back)
    if back < SETTLED_MM:
        return
    share = min(1.0, friction * pressed / back)
    for c in range(3):
        shift[c] += share * way[c]
    moved = share * back
    for _ in range(2):
        least = _update_gaps(field, work, near, shift, moved)
        if least >= 0.0:
            return
        found = _gather(field, work, near, shift, 0.0)
        way[:] = 0.0
        _push_apart(work, found, way)
        for c in range(3):
            shift[c] += way[c]
        moved = math.sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)


@njit(cache=True, nogil=True, error_model="numpy")
def _sum_up(
    patch: Patch, walls: Doubles, grounds: Doubles, work: Doubles, found: int,
    feel: Doubles, each: Doubles, out: Doubles,
) -> int:  # fmt: skip
    """Write how what is touched feels, and where, by the pushes' shares.

    Returns the number of the wall that pushes most, -1 where none does. Its share of
    bone left is `feel[5]`, its share of all pushes `feel[6]`.
    """
    begin = work.shape[0] - BEHIND
    total = 0.0
    for k in range(found):
        total += work[begin + k, 8]
    if total <= 0.0:
        return -1
    feel[:] = 0.0
    most = -1
    for k in range(found):
        touch = work[begin + k]
        share = touch[8] / total
        if share == 0.0:
            continue
        radius = work[int(touch[0]), 3]
        x = touch[2] - radius * touch[5]
        y = touch[3] - radius * touch[6]
        z = touch[4] - radius * touch[7]
        touch[WALL] = _feel_at(patch, walls, grounds, x, y, z, 0.0, each)
        for c in range(5):
            feel[c] += share * each[c]
        out[PLACE] += share * x
        out[PLACE + 1] += share * y
        out[PLACE + 2] += share * z
        if share > feel[6]:
            most = k
            feel[5], feel[6] = each[5], share
    return most


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _spring_n(feel: Doubles, length: float, stiffest: float) -> float:
    """Return the force of tissue pressed so far, and no steeper than allowed."""
    soft = min(length, feel[0])
    first = min(feel[1], stiffest) * soft
    return float(first + min(feel[2], stiffest) * (length - soft))


@njit(cache=True, nogil=True, error_model="numpy")
def _device_n(
    feel: Doubles, length: float, state: Doubles, settings: Doubles, out: Doubles
) -> float:
    """Return the force for the device: the spring's and the tissue's damping.

    Damping is at most half of what a sampled wall leaves of the device's own: b > K T
    / 2 + B (Colgate and Brown 1994). On a late tick the stiffness shrinks to what that
    tick bears, and recovers.
    """
    dt, period = settings[DT], settings[PERIOD]
    slope = feel[1] if length < feel[0] else feel[2]
    slope = min(slope, settings[STIFFEST])
    room = 0.5 * (settings[DAMPING] - 0.5 * slope * period)
    viscous = max(min(feel[4], room), 0.0)
    raw = (length - state[LENGTH]) / dt
    state[RATE] += (raw - state[RATE]) * dt / (FILTER_S + dt)
    out[SLOPE] = slope * state[SCALE]
    force = _spring_n(feel, length, settings[STIFFEST]) + viscous * state[RATE]
    return float(max(force, 0.0) * state[SCALE])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _add_force(
    out: Doubles, pose: Doubles, place: Doubles, x: float, y: float, z: float
) -> None:
    """Add a force at a place, and its torque about the tool's origin."""
    a, b, c = place[0] - pose[0, 3], place[1] - pose[1, 3], place[2] - pose[2, 3]
    out[FORCE] += x
    out[FORCE + 1] += y
    out[FORCE + 2] += z
    out[TORQUE] += b * z - c * y
    out[TORQUE + 1] += c * x - a * z
    out[TORQUE + 2] += a * y - b * x


@njit(cache=True, nogil=True, error_model="numpy")
def _pull(
    field: DistanceField, balls: Doubles, pose: Doubles, settings: Doubles,
    row: Doubles, out: Doubles,
) -> None:  # fmt: skip
    """Add what suction pulls towards tissue near the tool's opening."""
    ball = balls[int(settings[PULL_BALL])]
    for c in range(3):
        row[2 + c] = pose[c, 3]
        for e in range(3):
            row[2 + c] += pose[c, e] * ball[e]
    gap = free_mm(field, row[2], row[3], row[4]) - ball[3]
    if gap >= PULL_MM or not _outward(field, row):
        return
    # a sealed opening bears all of the pressure, one that is off a part of it
    force = -settings[PULL_N] * (1.0 - max(gap, 0.0) / PULL_MM) ** 2
    _add_force(out, pose, row[2:5], force * row[5], force * row[6], force * row[7])


@njit(cache=True, nogil=True, error_model="numpy")
def _set_anew(pose: Doubles, state: Doubles, has: float) -> None:
    """Put the proxy where the hand is; holes stay."""
    state[HAS] = has
    for c in range(3):
        state[PROXY + c] = state[HAND + c] = pose[c, 3]
    state[LENGTH] = state[RATE] = 0.0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _clip(out: Doubles, most_n: float) -> int:
    """Shorten the force, and the torque with it, to the most that may be."""
    size = math.sqrt(out[FORCE] ** 2 + out[FORCE + 1] ** 2 + out[FORCE + 2] ** 2)
    if size <= most_n:
        return 0
    out[FORCE : TORQUE + 3] *= most_n / size
    return CLIPPED


@njit(cache=True, nogil=True, error_model="numpy")
def _begin(pose: Doubles, settings: Doubles, state: Doubles, shift: Doubles) -> int:
    """Take in the pose: the shift that leaves the proxy where it was; flags."""
    total = 0.0
    for c in range(3):
        for e in range(4):
            total += pose[c, e]
    dt, period = settings[DT], settings[PERIOD]
    if not (math.isfinite(total) and 0.0 < dt < math.inf):
        state[HAS] = 0.0
        return FAULT
    flags = LATE if dt > LATE_SHARE * period > 0.0 else 0
    if state[HAS] == 0.0:
        state[SCALE] = 1.0
    share = min(1.0, period / dt) if period > 0.0 else 1.0
    state[SCALE] = min(share, state[SCALE] + dt / RECOVER_S)
    moved = 0.0
    for c in range(3):
        shift[c] = state[PROXY + c] - pose[c, 3]
        moved += (state[HAND + c] - pose[c, 3]) ** 2
        state[HAND + c] = pose[c, 3]
    if state[HAS] == 0.0 or moved > JUMP_MM * JUMP_MM:
        _set_anew(pose, state, 0.0)
        shift[:] = 0.0
        flags |= SEATED
    return flags


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _field(patch: Patch, state: Doubles, holes: Doubles) -> DistanceField:
    """Return the tissue that a tool meets: its holes are open to it."""
    count = min(int(state[BROKEN]), MOST_HOLES)
    return DistanceField(
        patch.distance, patch.voxel, spacing_of(patch.voxel), holes[:count]
    )


@njit(cache=True, nogil=True, error_model="numpy")
def touch_tick(
    patch: Patch, walls: Doubles, grounds: Doubles, balls: Doubles, pose: Doubles,
    settings: Doubles, state: Doubles, holes: Doubles, work: Doubles, out: Doubles,
) -> int:  # fmt: skip
    """Follow a tool for one tick; returns flags, and writes `out` ``(OUT,)``.

    walls: ``(256, FEEL)``; grounds: ``(256,)``. balls: ``(n, 4)`` middle in the tool's
    frame and radius, those of a jaw where they are now. pose: 4x4, mm from the tool.
    settings: ``(SETTINGS,)``. state ``(STATE,)`` and holes ``(MOST_HOLES, HOLE)`` are
    zeros at first and changed in place. work: ``(n + BEHIND, WORK)``, of no meaning
    between ticks. All are float64.

    A pose that is not finite, or time that does not pass, gives no force and `FAULT`.
    """
    out[:] = 0.0
    out[ROW] = out[BROKE] = -1.0
    begin = work.shape[0] - BEHIND
    vectors = work[begin + MOST_TOUCHES :]
    shift, way, start = vectors[0, :3], vectors[1, :3], vectors[2, :3]
    flags = _begin(pose, settings, state, shift)
    if flags & FAULT:
        return flags
    field = _field(patch, state, holes)
    if settings[PULL_N] > 0.0:
        row = vectors[3]
        _pull(field, balls, pose, settings, row, out)
    length = math.sqrt(shift[0] ** 2 + shift[1] ** 2 + shift[2] ** 2)
    near, least = place_balls(field, balls, pose, shift, length + 2.0 * STEP_MM, work)
    if state[HAS] == 0.0 and least < -SEAT_MM:
        return flags | BURIED
    state[HAS] = 1.0
    if least > length:
        # nothing lies between the proxy and the hand
        _set_anew(pose, state, 1.0)
        return flags | _clip(out, settings[MOST_N])
    start[:] = shift
    found, passes = _follow_hand(field, work, near, shift, way)
    out[PASSES] = passes
    feel, each = vectors[3], vectors[4]
    most = _sum_up(patch, walls, grounds, work, found, feel, each, out)
    if most < 0:
        # free, or on its way to the hand
        for c in range(3):
            state[PROXY + c] = pose[c, 3] + shift[c]
        state[LENGTH] = state[RATE] = 0.0
        return flags | _clip(out, settings[MOST_N])
    touch = work[begin + most]
    wall, radius = int(touch[WALL]), work[int(touch[0]), 3]
    # friction writes over the walls
    broken = vectors[4]
    broken[2:8] = touch[2:8]
    _keep_in_cone(field, work, near, shift, start, feel[3], way)
    length = math.sqrt(shift[0] ** 2 + shift[1] ** 2 + shift[2] ** 2)
    tissue_n = _spring_n(feel, length, math.inf)
    force = _device_n(feel, length, state, settings, out)
    scale = force / length if length > 0.0 else 0.0
    _add_force(
        out, pose, out[PLACE : PLACE + 3],
        scale * shift[0], scale * shift[1], scale * shift[2],
    )  # fmt: skip
    for c in range(3):
        state[PROXY + c] = pose[c, 3] + shift[c]
    state[LENGTH] = length
    out[DEPTH], out[TISSUE_N], out[ROW] = length, tissue_n, wall
    scatter = scatter_of(wall, broken[2], broken[3], broken[4])
    bears = walls[wall, BREAK_N] * feel[5] ** 2 * scatter
    if bears > 0.0 and tissue_n * feel[6] > bears:
        widest = balls[:, 3].max()
        _break(field, walls, wall, broken, radius, widest, state, holes)
        out[BROKE] = wall
    return flags | TOUCHING | _clip(out, settings[MOST_N])


@njit(cache=True, nogil=True, error_model="numpy")
def press_walls(
    patch: Patch, walls: Doubles, grounds: Doubles, balls: Doubles, pose: Doubles,
    state: Doubles, holes: Doubles, work: Doubles, out: Doubles,
) -> int:  # fmt: skip
    """Write what a tool presses that lies still where it is; returns flags.

    No proxy: the wall counts that resists most, by how deep the tool lies in it.
    Arguments as of `touch_tick`; the next tick begins anew.
    """
    out[:] = 0.0
    out[ROW] = out[BROKE] = -1.0
    state[HAS] = state[LENGTH] = state[RATE] = 0.0
    field = _field(patch, state, holes)
    vectors = work[work.shape[0] - BEHIND :]
    shift, touch, each, most = vectors[0, :3], vectors[1], vectors[2], vectors[3]
    shift[:] = 0.0
    near, _ = place_balls(field, balls, pose, shift, 0.0, work)
    for n in range(near):
        touch[2:5] = work[n, 0:3]
        if not _outward(field, touch):
            continue
        radius, deep = work[n, 3], -work[n, 4]
        x = work[n, 0] - (radius - deep) * touch[5]
        y = work[n, 1] - (radius - deep) * touch[6]
        z = work[n, 2] - (radius - deep) * touch[7]
        below = max(-free_mm(field, x, y, z), 0.0)
        row = _feel_at(patch, walls, grounds, x, y, z, below, each)
        newton = _spring_n(each, deep, math.inf)
        if newton > out[TISSUE_N]:
            out[TISSUE_N], out[DEPTH], out[ROW] = newton, deep, row
            out[PLACE], out[PLACE + 1], out[PLACE + 2] = x, y, z
            most[5:8] = touch[5:8]
            most[8], most[9] = radius, each[5]
            for c in range(3):
                # the ball as it touches
                most[2 + c] = touch[2 + c] + deep * touch[5 + c]
    if out[ROW] < 0.0:
        return 0
    newton, row = out[TISSUE_N], int(out[ROW])
    _add_force(
        out, pose, out[PLACE : PLACE + 3],
        newton * most[5], newton * most[6], newton * most[7],
    )  # fmt: skip
    bears = (
        walls[row, BREAK_N] * most[9] ** 2 * scatter_of(row, most[2], most[3], most[4])
    )
    if 0.0 < bears < newton:
        widest = balls[:, 3].max()
        _break(field, walls, row, most, most[8], widest, state, holes)
        out[BROKE] = row
    return TOUCHING


@njit(cache=True, nogil=True, error_model="numpy")
def follow_way(
    patch: Patch, walls: Doubles, grounds: Doubles, balls: Doubles, way: Doubles,
    steps: int, settings: Doubles, state: Doubles, holes: Doubles, work: Doubles,
    out: Doubles,
) -> int:  # fmt: skip
    """Follow a tool on its way from one sample to the next in equal ticks.

    way: ``(3, 4, 4)`` poses before and after; the third is written over. `out` and the
    flags are those of the last tick, but the largest of all forces of the tissue.
    """
    pose = way[2]
    flags, most = 0, 0.0
    for step in range(steps):
        share = (step + 1) / steps
        if step + 1 == steps:
            pose[:] = way[1]
        else:
            for c in range(3):
                for e in range(4):
                    pose[c, e] = way[0, c, e] + share * (way[1, c, e] - way[0, c, e])
            _straighten(pose)
        flags = touch_tick(
            patch, walls, grounds, balls, pose, settings, state, holes, work, out
        )  # fmt: skip
        most = max(most, out[TISSUE_N])
    out[TISSUE_N] = most
    return flags


@njit(cache=True, nogil=True, error_model="numpy")
def _straighten(pose: Doubles) -> None:
    """Make the turn of a pose that was interpolated a rotation again."""
    for e in (2, 1):
        if e == 1:
            along = 0.0
            for c in range(3):
                along += pose[c, 1] * pose[c, 2]
            for c in range(3):
                pose[c, 1] -= along * pose[c, 2]
        size = math.sqrt(pose[0, e] ** 2 + pose[1, e] ** 2 + pose[2, e] ** 2)
        for c in range(3):
            pose[c, e] /= size
    for c in range(3):
        a, b = (c + 1) % 3, (c + 2) % 3
        pose[c, 0] = pose[a, 1] * pose[b, 2] - pose[b, 1] * pose[a, 2]
