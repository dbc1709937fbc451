"""What an edited volume differs in from the one it was: bricks of 8 x 8 x 8 voxels.

A request names the volume as it was, which is stored once, and these bricks beside it.
A worker need not repeat the edits: it writes the bricks into a copy and has the edited
volume's bits, of any generation, in any order.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, RestOffsets, Volume
from system import UserError

EDGE = 8
"""Voxels along a brick."""

Box = tuple[NDArray[np.int64], NDArray[np.int64]]
"""First and last voxel, (i, j, k), as a `Change` has them."""


@dataclass(frozen=True, slots=True)
class VolumeChanges:
    """The bricks in which one volume differs from another.

    numbers: ``(n,)`` int32, ascending; bricks are counted with x fastest. values:
    ``(n, 8, 8, 8)`` of the volumes' type, 0 beyond the volume's faces.
    """

    numbers: NDArray[np.int32]
    values: NDArray[np.generic]

    def __len__(self) -> int:
        """Count the bricks."""
        return len(self.numbers)

    @classmethod
    def between(
        cls,
        base: NDArray[np.generic],
        edited: NDArray[np.generic],
        within: Box | None = None,
    ) -> "VolumeChanges":
        """Compare the bits of two volumes of one shape and type.

        within: the voxels that may differ; None for all of them.
        """
        if base.shape != edited.shape or base.dtype != edited.dtype:
            raise ValueError(
                f"{edited.dtype} {edited.shape} is no edit of {base.dtype} {base.shape}"
            )
        shape = np.array(edited.shape)
        low, high = np.zeros(3, np.int64), shape - 1
        if within is not None:
            low = np.maximum(within[0][::-1], 0) // EDGE * EDGE
            high = np.minimum(within[1][::-1] // EDGE * EDGE + EDGE, shape) - 1
        here = tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))
        bits = np.dtype(f"u{edited.dtype.itemsize}")
        differs = edited[here].view(bits) != base[here].view(bits)
        if not differs.any():
            none = np.empty((0, EDGE, EDGE, EDGE), edited.dtype)
            return cls(np.empty(0, np.int32), none)
        for axis, length in enumerate(differs.shape):
            starts = np.arange(0, length, EDGE)
            differs = np.logical_or.reduceat(differs, starts, axis=axis)
        bricks = np.argwhere(differs) + low // EDGE
        _, cy, cx = _counts(edited.shape)
        numbers = (bricks[:, 0] * cy + bricks[:, 1]) * cx + bricks[:, 2]
        values = np.zeros((len(bricks), EDGE, EDGE, EDGE), edited.dtype)
        for brick, (z, y, x) in zip(values, (bricks * EDGE).tolist(), strict=True):
            part = edited[z : z + EDGE, y : y + EDGE, x : x + EDGE]
            brick[tuple(slice(n) for n in part.shape)] = part
        return cls(numbers.astype(np.int32), values)

    def record(self) -> NDArray[np.int32]:
        """Return the array that travels: a row a brick, its number and its bits."""
        values = np.ascontiguousarray(self.values)
        bits = values.reshape(len(self), EDGE**3).view(np.int32)
        return np.concatenate([self.numbers[:, None], bits], axis=1)

    @classmethod
    def of_record(
        cls, record: NDArray[np.generic], base: NDArray[np.generic], name: str
    ) -> "VolumeChanges":
        """Read a record of a volume; UserError, beginning with `name`, for a wrong one.

        The bricks must be of the volume, ascending and each there once, their values
        finite.
        """
        wide = 1 + EDGE**3 * base.dtype.itemsize // 4
        if record.dtype != np.int32 or record.ndim != 2 or record.shape[1] != wide:
            raise UserError(
                f"{name}: bricks of {base.dtype} are rows of {wide} int32, got "
                f"{record.dtype} {record.shape}"
            )
        numbers = record[:, 0].astype(np.int64)
        bricks = math.prod(_counts(base.shape))
        if np.any(np.diff(numbers, prepend=-1, append=bricks) <= 0):
            raise UserError(
                f"{name}: bricks must ascend, each there once, and be some of the "
                f"volume's {bricks}"
            )
        edges = (len(record), EDGE, EDGE, EDGE)
        values = np.ascontiguousarray(record[:, 1:]).view(base.dtype).reshape(edges)
        if base.dtype.kind == "f" and not np.isfinite(values).all():
            raise UserError(f"{name}: a brick holds a value that is not finite")
        return cls(numbers.astype(np.int32), values)

    def applied(self, base: NDArray[np.generic]) -> NDArray[np.generic]:
        """Return a copy of a volume with the bricks in it."""
        edited = np.array(base)
        self._write(edited)
        return edited

    def alone(self, shape: tuple[int, ...]) -> NDArray[np.generic]:
        """Return a volume that is 0 but for the bricks; the rest takes no memory."""
        volume = np.zeros(shape, self.values.dtype)
        self._write(volume)
        return volume

    def box(self, shape: tuple[int, ...]) -> Box:
        """Return the first and last voxel of the bricks; there must be some."""
        _, cy, cx = _counts(shape)
        n = self.numbers.astype(np.int64)
        first = EDGE * np.stack([n % cx, n // cx % cy, n // (cy * cx)], axis=-1)
        last = np.array(shape[::-1]) - 1
        return first.min(axis=0), np.minimum(first.max(axis=0) + EDGE - 1, last)

    def _write(self, volume: NDArray[np.generic]) -> None:
        _, cy, cx = _counts(volume.shape)
        for number, brick in zip(self.numbers.tolist(), self.values, strict=True):
            places = number // (cy * cx), number // cx % cy, number % cx
            z, y, x = (EDGE * place for place in places)
            part = volume[z : z + EDGE, y : y + EDGE, x : x + EDGE]
            part[...] = brick[tuple(slice(n) for n in part.shape)]


def _counts(shape: tuple[int, ...]) -> tuple[int, int, int]:
    """Return the number of bricks along z, y, x."""
    nz, ny, nx = (-(-n // EDGE) for n in shape)
    return nz, ny, nx


Offsets = tuple[VolumeChanges, VolumeChanges, VolumeChanges]
"""What differs from 0 of `RestOffsets`: along x, y and z."""


def rest_offsets(offsets: Offsets | None, pristine: Volume) -> RestOffsets | None:
    """Return where tissue lies at rest; None where it is shown there.

    pristine: the distance before any tissue was taken, at rest.
    """
    if offsets is None or not any(offsets):
        return None
    boxes = [part.box(pristine.shape) for part in offsets if part]
    low, high = (np.array(ends) for ends in zip(*boxes, strict=True))
    x, y, z = (
        pristine.with_values(part.alone(pristine.shape), 0.0) for part in offsets
    )
    ends = np.concatenate([low.min(axis=0) - 1, high.max(axis=0) + 1])
    return RestOffsets(pristine, x, y, z, ends.astype(np.float32))


@dataclass(frozen=True, slots=True)
class FrozenSurface:
    """An air surface as it was at one moment, whatever is cut out of it later.

    surface: the living one, of which only what never changes is read. distance: what
    was cut by then; None where nobody operates. film: what had bled. pale: what was
    injected. bent: where the pristine distance was shown otherwise, by tissue that gave
    way to a tool. offsets: where that tissue lay at rest.
    """

    surface: AirSurface
    distance: VolumeChanges | None = None
    film: VolumeChanges | None = None
    bent: VolumeChanges | None = None
    offsets: Offsets | None = None
    pale: VolumeChanges | None = None

    @classmethod
    def of(
        cls,
        surface: AirSurface,
        within: Box | None = None,
        shown: AirSurface | None = None,
    ) -> "FrozenSurface":
        """Copy the bricks that differ; to be called by whoever edits, between edits.

        within: the voxels that were ever cut, or are bent; None compares all. shown:
        the surface as tools bend it; None where they do not.
        """
        wounds = surface.wounds
        if wounds is None:
            return cls(surface)
        film = wounds.film.values
        dry = np.broadcast_to(np.zeros((), film.dtype), film.shape)
        shown = shown or surface
        assert shown.wounds is not None
        pristine, bent, offsets = wounds.pristine.values, None, None
        if shown.wounds.pristine.values is not pristine:
            bent = VolumeChanges.between(pristine, shown.wounds.pristine.values, within)
        if shown.rest is not None and shown.rest.is_any:
            still = np.broadcast_to(np.zeros((), np.float32), pristine.shape)
            x, y, z = (
                VolumeChanges.between(still, axis.values, within)
                for axis in (shown.rest.x, shown.rest.y, shown.rest.z)
            )
            offsets = (x, y, z) if x or y or z else None
        return cls(
            surface,
            VolumeChanges.between(pristine, shown.distance.values, within),
            VolumeChanges.between(dry, film),
            bent,
            offsets,
            VolumeChanges.between(dry, wounds.pale.values)
            if wounds.pale is not None and wounds.pale.values.any()
            else None,
        )

    def thawed(self) -> AirSurface:
        """Return the surface as it was, with arrays of its own where it differs."""
        surface, wounds = self.surface, self.surface.wounds
        if wounds is None or self.distance is None or self.film is None:
            return surface
        film = wounds.film
        dry = np.zeros(film.shape, film.values.dtype)
        distance = self.distance.applied(wounds.pristine.values)
        pale = wounds.pale
        if pale is not None:
            then = self.pale.applied(dry) if self.pale else dry
            pale = pale.with_values(then, pale.background)
        pristine = wounds.pristine
        if self.bent:
            pristine = pristine.with_values(
                self.bent.applied(pristine.values), pristine.background
            )
        return replace(
            surface,
            distance=surface.distance.with_values(
                distance, surface.distance.background
            ),
            wounds=replace(
                wounds,
                pristine=pristine,
                film=film.with_values(self.film.applied(dry), film.background),
                pale=pale,
            ),
            rest=rest_offsets(self.offsets, wounds.pristine),
        )
