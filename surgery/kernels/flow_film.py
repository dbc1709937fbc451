"""Blood runs: sources, the way down, pools, drops, suction, and what is drawn.

Volumes are whole numbers, so what leaves one cell arrives in others to the last unit,
in any order. A step reads the state before it and adds up; nothing depends on the order
of cells in the pool.
"""

import math

import numpy as np
from numba import njit

from surgery.kernels.film_cells import (
    AREA,
    AXIS,
    BIN_MM,
    BORDER,
    EXIT,
    FIRST,
    HEIGHT,
    LEAST_UP,
    LINKS,
    PER_MM3,
    RATE,
    SECOND,
    SHARE,
    THIN,
    UNKNOWN,
    UP,
    VISCOUS,
    Bytes,
    Cells,
    Doubles,
    Ground,
    Ints,
    Longs,
    cell_of,
    land,
)

HANGS = -0.3
"""Blood drips from what faces down more than this cosine."""

TRICKLE = 3.0
"""A film thinner than so many times what a wall holds wets no second way: it keeps to
where blood ran before, as trickles do."""

WAKES = 1.04
"""Share of what a wall holds from which on blood runs: what has run off rests."""

SILL_MM = 2e-4
"""Pools that differ in height by less are level."""

SLOPES = 8
"""Cells that run down at once: their equations are solved side by side."""

HELD_DROP = 0.4
"""Share of the thickness that drips at which a drop leaves the rest behind."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _head(thickness: float, hold: float, up: float) -> float:
    """Return how much higher blood stands than the surface that it lies on, mm."""
    if up < -0.1 or thickness <= hold:
        return 0.0
    return (thickness - hold) / max(up, LEAST_UP)


@njit(cache=True, nogil=True, error_model="numpy")
def bleed(
    ground: Ground, cells: Cells, places: Ints, started: Longs, rates: Doubles,
    emitted: Longs, step: int, dt: float,
) -> int:  # fmt: skip
    """Let every source give what is due by the end of a step; returns the volume.

    A source that began t seconds ago has given ``rate tau t / (t + tau)``: its rate
    falls as 1 / (1 + t / tau)^2. rates: ``(n, 2)`` units/s at first, and tau in s.
    """
    total = 0
    for n in range(places.size):
        t = (step + 1 - started[n]) * dt
        tau = rates[n, 1]
        due = math.floor(rates[n, 0] * tau * t / (t + tau)) - emitted[n]
        if due <= 0:
            continue
        row = cell_of(ground, cells, places[n])
        if row < 0:
            continue
        emitted[n] += due
        cells.volume[row] += due
        total += due
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _stay(
    thick: Doubles, rate: Doubles, hold: float, stays: Doubles, left: Longs
) -> None:
    """Find the thickness that a step leaves on each of `SLOPES` cells.

    The root of ``t + rate t^2 (t - hold) = thick`` by Newton's method: an implicit step
    of the thin film's flow, which no length of step upsets. stays: a guess before.
    left: scratch.
    """
    count = thick.size
    left[:] = 1
    for _ in range(24):
        going = 0
        for n in range(count):
            t, its = stays[n], rate[n]
            value = t + its * t * t * (t - hold) - thick[n]
            less = value / (1.0 + its * t * (3.0 * t - 2.0 * hold))
            after = t - less
            go = left[n]
            stays[n] = after if go != 0 else t
            go = go if abs(less) >= 1e-4 * after else 0
            left[n] = go
            going |= go
        if going == 0:
            break
    for n in range(SLOPES):
        stays[n] = min(max(stays[n], hold), thick[n])


@njit(cache=True, nogil=True, error_model="numpy")
def run_down(
    ground: Ground, cells: Cells, heads: Ints, step: int, dt: float, hold: float
) -> int:
    """Let all that lies on slopes run down, from top to bottom; returns moving cells.

    Cells are taken in bins of height, so that one step can carry blood over many cells.
    heads: ``(bins,)`` first cell of each bin, all -1 before and after.
    """
    lowest = ground.lowest
    _, _, _, volume, _, before, shape, marks, links, beside, drops = cells[:11]
    following, queued, stands = cells.next, cells.queued, cells.head
    wakes = WAKES * hold
    thick, rate = np.empty(SLOPES), np.empty(SLOPES)
    stays, left = np.empty(SLOPES), np.empty(SLOPES, np.int64)
    rows = np.empty(SLOPES, np.int64)
    moving = 0
    top, low = -1, heads.size
    for row in range(cells.used[0]):
        held = volume[row]
        before[row] = held
        high = held * shape[row, THIN]
        stands[row] = _head(high, hold, shape[row, UP])
        if high <= wakes or shape[row, RATE] == 0.0:
            continue
        bin_ = int((shape[row, HEIGHT] - lowest) / BIN_MM)
        following[row] = heads[bin_]
        heads[bin_] = row
        queued[row] = step
        top = max(top, bin_)
        low = min(low, bin_)
    bin_ = top
    while bin_ >= low:
        row = heads[bin_]
        heads[bin_] = -1
        while row >= 0:
            count = 0
            while row >= 0 and count < SLOPES:
                thin = float(shape[row, THIN])
                thick[count] = volume[row] * thin
                rate[count] = dt * shape[row, RATE]
                stays[count] = min(max(before[row] * thin, hold), thick[count])
                rows[count] = row
                count += 1
                row = following[row]
            after = row
            moving += count
            for n in range(count, SLOPES):
                thick[n], rate[n], stays[n] = hold, 0.0, hold
            _stay(thick, rate, hold, stays, left)
            for n in range(count):
                row = rows[n]
                off = max(volume[row] - stays[n] / float(shape[row, THIN]), 0.0)
                share = float(shape[row, SHARE])
                if thick[n] < TRICKLE * hold and 0.0 < share < 1.0:
                    other = beside[row, marks[row, FIRST]]
                    first = other < 0 or before[other] == 0
                    other = beside[row, marks[row, SECOND]]
                    second = other < 0 or before[other] == 0
                    if first != second:
                        share = 0.0 if first else 1.0
                    elif first and share != 0.5:
                        share = 1.0 if share > 0.5 else 0.0
                for side in range(2):
                    part = 1.0 - share if side else share
                    if part <= 0.0:
                        continue
                    link = marks[row, FIRST + side]
                    other = beside[row, link]
                    if other < 0:
                        other = cell_of(ground, cells, links[row, link])
                        if other < 0:
                            continue
                    its = float(shape[other, THIN])
                    if stands[other] >= drops[row, link, 0]:
                        # it would run into a pool that already reaches here
                        continue
                    amount = math.floor(part * off)
                    volume[row] -= amount
                    volume[other] += amount
                    if queued[other] == step or shape[other, RATE] == 0.0:
                        continue
                    if volume[other] * its > wakes:
                        to = int((shape[other, HEIGHT] - lowest) / BIN_MM)
                        if to < bin_:
                            queued[other] = step
                            following[other] = heads[to]
                            heads[to] = other
                            low = min(low, to)
            row = after
        bin_ -= 1
    return moving


@njit(cache=True, nogil=True, error_model="numpy")
def find_pools(cells: Cells, hold: float, pools: Ints) -> int:
    """List the cells whose blood does not run down a slope; returns how many.

    They have nothing lower beside them, or a pool reaches up to them. Finds the head
    of every cell.
    """
    _, _, _, volume, _, _, shape, marks, _, beside, drops = cells[:11]
    stands = cells.head
    count = int(cells.used[0])
    for row in range(count):
        stands[row] = _head(volume[row] * shape[row, THIN], hold, shape[row, UP])
    found = 0
    for row in range(count):
        if volume[row] * shape[row, THIN] <= WAKES * hold or shape[row, UP] < -0.1:
            continue
        is_pool = shape[row, RATE] == 0.0
        for side in range(2):
            link = marks[row, FIRST + side]
            if is_pool or link == 255:
                continue
            other = beside[row, link]
            is_pool = other >= 0 and stands[other] >= drops[row, link, 0]
        if is_pool:
            pools[found] = row
            found += 1
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def level(ground: Ground, cells: Cells, pools: Ints, dt: float, hold: float) -> bool:
    """Let pools flow from where they stand higher; tell whether any did.

    By lubrication, at most an eighth of what would make two neighbours level. Slopes
    that are not covered by a pool are left to `run_down`. pools: rows.
    """
    _, _, _, volume, delta, _, shape, marks, links, beside, drops = cells[:11]
    stands, from_above = cells.head, cells.wide
    flows, heads, wides = np.empty(LINKS), np.empty(LINKS), np.empty(LINKS)
    rows = np.empty(LINKS, np.int64)
    moved = False
    for turn in range(pools.size):
        row = pools[turn]
        head = stands[row]
        if head <= SILL_MM:
            continue
        area, wide = float(shape[row, AREA]), from_above[row]
        thick = volume[row] * shape[row, THIN]
        first, second = marks[row, FIRST], marks[row, SECOND]
        for link in range(LINKS):
            other = beside[row, link]
            if other >= 0:
                rows[link] = other
                heads[link], wides[link] = stands[other], from_above[other]
                continue
            # nothing flows there
            rows[link], heads[link], wides[link] = row, math.inf, wide
            way = drops[row, link, 0]
            is_slope = (first == link or second == link) and way >= BIN_MM
            if links[row, link] < 0 or way + head <= SILL_MM or is_slope:
                continue
            other = cell_of(ground, cells, links[row, link])
            if other >= 0:
                rows[link], heads[link] = other, 0.0
        viscous = VISCOUS * thick**3
        # no branches: the links are taken side by side
        for link in range(LINKS):
            way = float(drops[row, link, 0])
            above = way + head - heads[link]
            flow = viscous * above * drops[row, link, 1] * area * dt
            most = 0.25 * above * wide * wides[link] / (wide + wides[link])
            is_slope = (first == link) | (second == link)
            is_left = is_slope & (way >= BIN_MM) & (heads[link] < way)
            flow = flow if flow < most else most
            flows[link] = flow if (above > SILL_MM) & (not is_left) else 0.0
        total = 0.0
        for link in range(LINKS):
            total += flows[link]
        if total == 0.0:
            continue
        least = min(1.0, (thick - hold) * area / total)
        for link in range(LINKS):
            amount = math.floor(flows[link] * least * PER_MM3)
            if amount > 0:
                delta[row] -= amount
                delta[rows[link]] += amount
                moved = True
    if moved:
        for row in range(cells.used[0]):
            if delta[row] != 0:
                volume[row] += delta[row]
                delta[row] = 0
                thick = volume[row] * shape[row, THIN]
                stands[row] = _head(thick, hold, shape[row, UP])
    return moved


@njit(cache=True, nogil=True, error_model="numpy")
def drip(
    ground: Ground, cells: Cells, hold: float, drop_mm: float, left: Longs
) -> None:
    """Let drops fall from what faces down, and what reached a way out get out.

    left: ``(4,)`` volumes by the way out.
    """
    for row in range(cells.used[0]):
        volume = cells.volume[row]
        area = cells.shape[row, AREA] * PER_MM3
        if volume <= hold * area:
            continue
        out = cells.marks[row, EXIT]
        if out:
            amount = volume - math.floor(hold * area)
            cells.volume[row] -= amount
            left[out] += amount
            continue
        if cells.shape[row, UP] > HANGS or volume <= drop_mm * area:
            continue
        amount = volume - math.floor(HELD_DROP * drop_mm * area)
        if cells.landing[row] == UNKNOWN:
            cells.landing[row] = land(ground, cells.voxel[row])
        to = cells.landing[row]
        if to < 0:
            cells.volume[row] -= amount
            left[BORDER] += amount
            continue
        other = cell_of(ground, cells, to)
        if other >= 0:
            cells.volume[row] -= amount
            cells.delta[other] += amount
    for row in range(cells.used[0]):
        cells.volume[row] += cells.delta[row]
        cells.delta[row] = 0


@njit(cache=True, nogil=True, error_model="numpy")
def run(
    ground: Ground, cells: Cells, heads: Ints, step: int, dt: float,
    flow: tuple[float, float, int], left: Longs,
) -> None:  # fmt: skip
    """Let all blood run for a step of dt seconds: down, level, and drip.

    heads: of `run_down`. flow: thicknesses that stay and that drip, mm, and how often
    pools are levelled. left: of `drip`.
    """
    hold, drop_mm, rounds = flow
    run_down(ground, cells, heads, step, dt, hold)
    pools = cells.next[: find_pools(cells, hold, cells.next)]
    for _ in range(rounds):
        if not level(ground, cells, pools, dt / rounds, hold):
            break
    drip(ground, cells, hold, drop_mm, left)


@njit(cache=True, nogil=True, error_model="numpy")
def suck(
    cells: Cells, shape: tuple[int, int, int], spacing: Doubles, tip: Doubles,
    reach: float, most: int,
) -> int:  # fmt: skip
    """Take up to `most` units from cells within reach of a tip; returns the volume.

    Each gives the same share of what it has, weighted with its nearness.
    """
    _, ny, nx = shape
    total = 0.0
    for turn in range(2):
        taken = 0
        share = min(1.0, most / total) if turn else 0.0
        for row in range(cells.used[0]):
            if cells.volume[row] == 0:
                continue
            voxel = cells.voxel[row]
            x = voxel % nx * spacing[0] - tip[0]
            y = voxel // nx % ny * spacing[1] - tip[1]
            z = voxel // (nx * ny) * spacing[2] - tip[2]
            square = (x * x + y * y + z * z) / (reach * reach)
            if square >= 1.0:
                continue
            give = math.floor((1.0 - square) * 1024.0) / 1024.0 * cells.volume[row]
            if turn == 0:
                total += math.floor(give)
            else:
                amount = math.floor(math.floor(give) * share)
                cells.volume[row] -= amount
                taken += amount
        if total == 0.0:
            return 0
    return taken


@njit(cache=True, nogil=True, error_model="numpy")
def paint(
    cells: Cells, rows: Longs, per_unit: float, least: int, spread: Ints,
    film: Bytes, box: Longs,
) -> int:  # fmt: skip
    """Draw cells whose thickness changed by more than `least` units; returns how many.

    A cell's thickness is spread over its own, the next and the last layer of voxels
    along its axis, and there over 3 x 3 voxels as (1 2 1)/4 each way: on a plane the
    sum of all cells is their thickness. spread: these sums times 16, kept, so that what
    was drawn can be taken away. box: first and last voxel drawn, extended. rows: which
    cells; all where it is empty.
    """
    nz, ny, nx = film.shape
    count = rows.size if rows.size else int(cells.used[0])
    _, _, place, volume, _, _, shape, marks = cells[:8]
    told = cells.told
    drawn = 0
    for n in range(count):
        row = rows[n] if rows.size else n
        thick = volume[row] * shape[row, THIN]
        code = min(math.floor(thick * per_unit + 0.5), 4000)
        more = code - told[row]
        if abs(more) <= least:
            continue
        told[row] = code
        drawn += 1
        voxel = place[row]
        i, j, k = voxel % nx, voxel // nx % ny, voxel // (nx * ny)
        axis = marks[row, AXIS]
        for m in range(27):
            a, b, c = m % 3 - 1, m // 3 % 3 - 1, m // 9 - 1
            p, q, r = i + a, j + b, k + c
            if p < 0 or q < 0 or r < 0 or p >= nx or q >= ny or r >= nz:
                continue
            weight = 1
            if axis != 0:
                weight *= 2 - abs(a)
            if axis != 1:
                weight *= 2 - abs(b)
            if axis != 2:
                weight *= 2 - abs(c)
            at = (r * ny + q) * nx + p
            spread[at] += weight * more
            film[r, q, p] = min(spread[at] >> 4, 255)
        box[0], box[3] = min(box[0], i - 1), max(box[3], i + 1)
        box[1], box[4] = min(box[1], j - 1), max(box[4], j + 1)
        box[2], box[5] = min(box[2], k - 1), max(box[5], k + 1)
    return drawn
