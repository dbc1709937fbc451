"""The mucosa of a head as small patches, by site."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from renderers.scene import Volume
from scenarios.coverage.sites import sites_of
from scenarios.structures import Structures

Doubles = NDArray[np.float64]

PATCH_MM = 1.0
"""Size of a patch."""

SLIVER_MM2, LEAST_MM2 = 0.4, 0.02
"""Patches smaller than the first belong to the largest one beside them; what is smaller
than the second even so is left out."""

CHECKED = 2048
"""Places of the surface from which what the item buffer says is checked."""

SEED = 1


@dataclass(frozen=True)
class Mucosa:
    """The patches of a head that can be seen in principle.

    A patch is what the surface has in a block of the grid, and faces one way along an
    axis of it: so the two sides of a thin wall are two patches. Of closed cells nothing
    counts: no scope sees them unless they are opened.

    places, normals: ``(n, 3)`` LPS mm and unit into the air. area_mm2: ``(n,)``.
    site: ``(n,)`` places in sites, which carry their side. table: patches by block and
    facing, -1 for none; see `key_of`. block, blocks: ``(3,)`` voxels of a block, and
    how many. grid: the volume that the blocks are of. checked, checked_normals:
    ``(m, 3)`` of places drawn from the surface; checked_patch: theirs.
    """

    places: Doubles
    normals: Doubles
    area_mm2: Doubles
    site: NDArray[np.int64]
    sites: tuple[str, ...]
    table: NDArray[np.int32]
    block: NDArray[np.int64]
    blocks: NDArray[np.int64]
    grid: Volume = field(repr=False)
    checked: Doubles
    checked_normals: Doubles
    checked_patch: NDArray[np.int64]

    @cached_property
    def members(self) -> dict[str, NDArray[np.int64]]:
        """Return the places of sites by name; without a side those of both."""
        names = dict.fromkeys(self.sites)
        names |= dict.fromkeys(name.rpartition(", ")[0] or name for name in self.sites)
        return {
            name: np.array(
                [n for n, s in enumerate(self.sites) if s.partition(", ")[0] == name]
                or [self.sites.index(name)],
                np.int64,
            )
            for name in names
        }

    def patch_at(self, places: Doubles, normals: Doubles) -> NDArray[np.int64]:
        """Return the patches at ``(n, 3)`` places that face `normals`; -1 for none."""
        matrix = self.grid.voxel_from_world
        at = places @ matrix[:3, :3].T + matrix[:3, 3]
        into = normals @ self.grid.direction
        axis = np.abs(into).argmax(axis=1)
        ways = into[np.arange(len(into)), axis]
        facing = 2 * axis + (ways > 0.0)
        cell = np.floor((at + 0.5) / self.block).astype(np.int64)
        inside = np.all((cell >= 0) & (cell < self.blocks), axis=1)
        cell[~inside] = 0
        i, j, k = cell.T
        key = 6 * ((k * self.blocks[1] + j) * self.blocks[0] + i) + facing
        return np.where(inside, self.table[key], -1).astype(np.int64)


def mucosa_of(
    distance: Volume, structures: Structures | None = None, seed: int = SEED
) -> Mucosa:
    """Divide the surface of a head into patches.

    distance: signed air distance, mm, negative in air. structures: what names places;
    None where nobody knows. seed: of the places that are checked.
    """
    from scenarios.coverage.kernels.gather_patches import gather_patches

    spacing = np.ascontiguousarray(distance.spacing_mm)
    block = np.maximum(np.rint(PATCH_MM / spacing), 1).astype(np.int64)
    blocks = -(-np.array(distance.shape[::-1], np.int64) // block)
    reached = _open_air(distance)
    count = 6 * int(np.prod(blocks))
    area, sums = np.zeros(count), np.zeros((count, 6))
    values = np.asarray(distance.values, np.float32)
    gather_patches(values, reached, spacing, block, blocks, area, sums)
    owner = _owners(area, blocks)
    slivers = np.flatnonzero(owner != np.arange(count))
    np.add.at(area, owner[slivers], area[slivers])
    np.add.at(sums, owner[slivers], sums[slivers])
    area[slivers] = 0.0
    keys = np.flatnonzero(area > LEAST_MM2)
    sums, area = sums[keys] / area[keys, None], area[keys]
    matrix = distance.world_from_voxel
    places = sums[:, :3] @ matrix[:3, :3].T + matrix[:3, 3]
    normals = sums[:, 3:] @ distance.direction.T
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    named = sites_of(places, normals, structures)
    # numpy sorts texts without letting go of the interpreter: a window would wait
    names = tuple(sorted({name for name in named if name}))
    chosen = np.flatnonzero([bool(name) for name in named])
    number_of = {name: number for number, name in enumerate(names)}
    numbers = [number_of[name] for name in named if name]
    table = np.full(count, -1, np.int32)
    table[keys[chosen]] = np.arange(len(chosen))
    table[slivers] = table[owner[slivers]]
    mucosa = Mucosa(
        places[chosen],
        normals[chosen],
        area[chosen],
        np.array(numbers, np.int64),
        names,
        table,
        block,
        blocks,
        distance,
        np.empty((0, 3)),
        np.empty((0, 3)),
        np.empty(0, np.int64),
    )
    return _with_checks(mucosa, distance, np.random.default_rng(seed))


def _owners(area_mm2: Doubles, blocks: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the key that each key's area belongs to: mostly itself.

    A sliver belongs to the largest patch of its block that does not face the other way,
    or of a block beside it that faces the same way.
    """
    keys = np.arange(len(area_mm2))
    small = keys[(area_mm2 > 0.0) & (area_mm2 < SLIVER_MM2)]
    block, facing = small // 6, small % 6
    # facings come in opposite pairs
    others = [6 * block + (facing + n) % 6 for n in range(1, 6)]
    others = [np.where(other % 6 == facing ^ 1, small, other) for other in others]
    for axis, stride in enumerate((1, blocks[0], blocks[0] * blocks[1])):
        at = block // stride % blocks[axis]
        others.append(np.where(at > 0, small - 6 * stride, small))
        others.append(np.where(at < blocks[axis] - 1, small + 6 * stride, small))
    beside = np.stack(others)
    best = beside[area_mm2[beside].argmax(axis=0), np.arange(len(small))]
    # never a chain: what owns another is no sliver
    is_larger = area_mm2[best] >= SLIVER_MM2
    keys[small[is_larger]] = best[is_larger]
    return keys


def _open_air(distance: Volume) -> NDArray[np.bool_]:
    """Return where the largest room of air is: the nose, and what opens into it."""
    rooms, count = ndimage.label(distance.values < 0)
    if count < 2:
        return np.asarray(rooms, np.bool_)
    sizes = np.bincount(rooms.ravel(), minlength=count + 1)
    largest: NDArray[np.bool_] = rooms == 1 + int(np.argmax(sizes[1:]))
    return largest


def _with_checks(mucosa: Mucosa, distance: Volume, rng: np.random.Generator) -> Mucosa:
    """Draw places from the surface, evenly within each site.

    A patch is drawn by its area, a place of it by a shift along it, and that is led to
    the surface by Newton's steps. Where it belongs to is asked anew.
    """
    if not len(mucosa.area_mm2):
        return mucosa
    area, count = mucosa.area_mm2, len(mucosa.sites)
    by_site = np.bincount(mucosa.site, area, count)[mucosa.site]
    # half of them alike for each site: small ones are told too
    share = 0.5 * area / area.sum() + 0.5 * area / (by_site * count)
    drawn = rng.choice(len(share), CHECKED, p=share)
    shift = rng.uniform(-PATCH_MM / 2, PATCH_MM / 2, (CHECKED, 3))
    normals = mucosa.normals[drawn]
    shift -= (shift * normals).sum(axis=1)[:, None] * normals
    places = mucosa.places[drawn] + shift
    for _ in range(4):
        slope = _slopes(distance, places)
        square = np.maximum((slope**2).sum(axis=1), 0.04)
        away = distance.sample(places) / square
        places = places - np.clip(away, -1.0, 1.0)[:, None] * slope
    slope = _slopes(distance, places)
    length = np.linalg.norm(slope, axis=1)
    normals = -slope / np.maximum(length, 1e-9)[:, None]
    patch = mucosa.patch_at(places, normals)
    good = (patch >= 0) & (length > 0.2)
    good &= np.abs(distance.sample(places)) < 0.1
    return Mucosa(
        **{
            **{name: getattr(mucosa, name) for name in Mucosa.__dataclass_fields__},
            "checked": np.ascontiguousarray(places[good]),
            "checked_normals": np.ascontiguousarray(normals[good]),
            "checked_patch": patch[good],
        }
    )


def _slopes(distance: Volume, places: Doubles) -> Doubles:
    """Return the field's gradient at ``(n, 3)`` places."""
    step = 0.5 * float(distance.spacing_mm.min())
    around = step * np.eye(3)
    ahead = distance.sample(places[:, None] + around)
    behind = distance.sample(places[:, None] - around)
    return (ahead - behind) / (2 * step)
