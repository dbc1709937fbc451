"""Where a careful surgeon bites next, of all the tissue that is to be taken."""

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.hazard_volumes import HazardVolumes
from anatomy.tissue import Label
from renderers.scene import Volume
from scenarios.tasks.rules import is_in_sight

_Doubles = NDArray[np.float64]

SKIN_MM = 1.2
"""Tissue that is to be taken begins where it is so near to air."""

AROUND_MM = 4.5
"""Edge of the cube that a bite is taken for."""

SPARED, FAR_PER_MM = 2.0, 0.01
"""A bite's share of what is to be spared counts for so many times as much as its share
of what is wanted; and a place is worth so much less for each mm that it is away."""

KEPT_MM = 2.0
"""What is so near to a hazard is taken last."""

NOSTRIL_MM, ENTRIES = 4.0, 8
"""A straight tool passes the nostril's middle, or a ring about it; through so many
places of the ring."""

SOFT_MM, BITTEN_MM = 12.0, 5.0
"""The first part of a tool's way, where the nostril yields, and its last, where it
works, may lie in tissue."""

POINTS = 40
"""At which a tool's way is looked at."""

BLOCKED_PER_MM = 0.08
"""A place is worth so much less for each mm of tissue on the straightest way there."""

AS_GOOD, SAME_MM = 0.7, 0.3
"""Places that are worth so much of the best are as good; nearer ones are the same."""

GRIPPED = 40
"""Places at which a tool in hand is tried, at most."""

LOOKED_AT = 80
"""Places that are tried for sight, at most, the best first."""


class BitePlace(NamedTuple):
    """Where to bite, ``(3,)`` LPS mm.

    is_seen: the eye sees it. worth: what the tool in hand is worth there, see
    `ToolPlan.worth`; infinite where nobody knows.
    """

    place_mm: _Doubles
    is_seen: bool
    worth: float = math.inf


def bite_place(
    distance: Volume,
    labels: Volume,
    places: _Doubles,
    tip_mm: _Doubles,
    eye_mm: _Doubles,
    nostril_mm: _Doubles,
    spared: Iterable[str] = (),
    hazards: HazardVolumes | None = None,
    grip: Callable[[_Doubles], _Doubles] | None = None,
    most: int = GRIPPED,
    kept_mm: _Doubles | None = None,
) -> BitePlace | None:
    """Return the place for the next bite; see `BitePlace`.

    distance: signed air distance as the head is cut, mm. labels: of the head. places:
    ``(n, 3)`` of tissue that is to be taken, as far as it is still there. Of those near
    to air the one is best that has much of it around and little of what is spared, no
    hazard near and nothing before it on a straight way from the nostril; what the eye
    sees goes before the rest. grip: tells what the tool in hand is worth at places
    ``(n, 3)``; of those that are seen, of so many at most, one is best then at which it
    is worth nearly the most: kept_mm, ``(3,)``, where it was sent before, or else the
    nearest. None for no places.
    """
    deep = distance.nearest(places)
    places = places[deep > 0.0]
    deep = deep[deep > 0.0]
    if not len(places):
        return None
    worth = _shares(labels, places, spared)
    worth -= FAR_PER_MM * np.linalg.norm(places - tip_mm, axis=1)
    skin = deep < SKIN_MM
    if hazards is not None:
        gaps = [hazards.distance_mm(name, places) for name in hazards.names]
        free = skin & (np.min(gaps, axis=0) > KEPT_MM)
        skin = free if free.any() else skin
    order = np.flatnonzero(skin)
    if not len(order):
        return None
    order = order[np.argsort(-worth[order])]
    order = order[:: max(len(order) // LOOKED_AT, 1)]
    if grip is not None:
        # whatever is near: what the tool can hold is worth more
        some = np.flatnonzero(skin)
        some = some[:: max(len(some) // (4 * GRIPPED), 1)]
        seen = [n for n in some if is_in_sight(distance, eye_mm, places[n])]
        seen = seen[:: max(len(seen) // most, 1)]
        if kept_mm is not None:
            same = np.linalg.norm(places - kept_mm, axis=1) < SAME_MM
            seen += list(np.flatnonzero(same & skin)[:1])
        if seen:
            worths = grip(places[seen])
            near = kept_mm if kept_mm is not None else tip_mm
            away = np.linalg.norm(places[seen] - near, axis=1)
            good = worths >= max(AS_GOOD * worths.max(), 1e-9)
            if good.any():
                best = int(np.argmin(np.where(good, away, np.inf)))
                return BitePlace(places[seen[best]], True, float(worths[best]))
    blocked_mm = _blocked_mm(distance, places[order], nostril_mm)
    order = order[np.argsort(BLOCKED_PER_MM * blocked_mm - worth[order])]
    worth_there = math.inf if grip is None else 0.0
    for number in order:
        if is_in_sight(distance, eye_mm, places[number]):
            return BitePlace(places[number], True, worth_there)
    return BitePlace(places[order[0]], False, worth_there)


def _blocked_mm(distance: Volume, places: _Doubles, nostril_mm: _Doubles) -> _Doubles:
    """Return how deep the straightest way to each place lies in tissue, mm."""
    along = places.mean(axis=0) - nostril_mm
    along /= max(float(np.linalg.norm(along)), 1e-9)
    across = np.linalg.svd(along[None])[2][1:]
    turns = np.arange(ENTRIES) * 2.0 * np.pi / ENTRIES
    ring = np.stack([np.cos(turns), np.sin(turns)], axis=1) @ across
    entries = nostril_mm + NOSTRIL_MM * np.vstack([np.zeros(3), ring])
    ways = places[:, None] - entries
    lengths = np.maximum(np.linalg.norm(ways, axis=2), 1e-9)
    first = np.minimum(SOFT_MM / lengths, 1.0)
    last = np.maximum(1.0 - BITTEN_MM / lengths, first)
    share = first[..., None] + np.linspace(0, 1, POINTS) * (last - first)[..., None]
    points = entries[:, None] + share[..., None] * ways[:, :, None]
    deepest = distance.sample(points).max(axis=2)
    found: _Doubles = np.maximum(deepest.min(axis=1), 0.0)
    return found


def _shares(labels: Volume, places: _Doubles, spared: Iterable[str]) -> _Doubles:
    """Return of each place the share of wanted tissue around it, less the spared."""
    matrix, size = labels.voxel_from_world, labels.shape[::-1]
    voxels = np.rint(places @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.int64)
    voxels = np.clip(voxels, 0, np.array(size) - 1)
    wide = np.maximum(np.rint(AROUND_MM / labels.spacing_mm).astype(int), 1)
    low = np.maximum(voxels.min(axis=0) - wide, 0)
    high = np.minimum(voxels.max(axis=0) + wide + 1, size)
    i, j, k = (voxels - low).T
    here = tuple(slice(low[a], high[a]) for a in (2, 1, 0))
    wanted = np.zeros([high[a] - low[a] for a in (2, 1, 0)], np.float32)
    wanted[k, j, i] = 1.0
    known = {label.name.lower().replace("_", " "): label.value for label in Label}
    numbers = [known[name] for name in spared if name in known]
    other = np.isin(labels.values[here], numbers).astype(np.float32)
    edge = tuple(int(wide[a]) for a in (2, 1, 0))
    shares = ndimage.uniform_filter(wanted - SPARED * other, edge, mode="constant")
    found: _Doubles = shares[k, j, i].astype(np.float64)
    return found
