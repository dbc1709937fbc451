"""Injection: mucosa pales where fluid was injected.

Fluid with a vasoconstrictor spreads from the needle's point through the tissue as a
ball, whose radius follows from its volume. Mucosa in it has little blood left. It does
not cross air: only tissue that hangs together with the point within the ball is paled.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from renderers.scene import Volume
from system import UserError

ML_PER_S = 0.1
"""Flow while the pedal is down: a design value; a millilitre syringe lasts 10 s."""

SHARE = 0.25
"""Of its volume, tissue takes up so much fluid: a design value. 0.15 ml, an injection
of a second and a half, then make a ball of 5.2 mm radius."""

EDGE_MM = 1.5
"""Over this the pallor fades at the rim of the ball."""

MERGED_MM = 1.5
"""What is injected so near to the last place goes to the same depot."""

DRAWN_ML = 0.01
"""Steps in which a growing depot is drawn: the same whatever the samples' rate."""

Box = tuple[NDArray[np.int64], NDArray[np.int64]]
"""First and last voxel that were drawn, (i, j, k)."""


@dataclass(frozen=True, slots=True)
class InjectionSite:
    """What was injected at one place: ``(3,)`` LPS mm, ml."""

    place_mm: tuple[float, float, float]
    ml: float


@dataclass(frozen=True, slots=True)
class InjectionState:
    """An injection between two samples: the pale voxels, and what made them."""

    voxels: NDArray[np.int64]
    pale: NDArray[np.uint8]
    depots: tuple[InjectionSite, ...]
    drawn: int


class Injection:
    """Pale the mucosa round a needle's point.

    depots: in order of time.
    """

    def __init__(self, distance: Volume, pale: NDArray[np.uint8]) -> None:
        """Begin with nothing injected.

        distance: signed air distance, mm, negative in air, read in place. pale: of its
        shape, 255 where mucosa has lost what blood it can; written in place.
        """
        if pale.shape != distance.shape or pale.dtype != np.uint8:
            raise UserError(
                f"pallor must be uint8 of shape {distance.shape}, got {pale.dtype} "
                f"{pale.shape}"
            )
        self.depots: tuple[InjectionSite, ...] = ()
        self._distance = distance
        self._pale = pale
        self._drawn = 0
        """Steps of the newest depot that are drawn."""

    @property
    def ml(self) -> float:
        """Return what was injected in all."""
        return math.fsum(depot.ml for depot in self.depots)

    def inject(self, place_mm: NDArray[np.float64], seconds: float) -> Box | None:
        """Let fluid flow at a place in tissue, LPS mm; return what was drawn anew.

        Fluid that flows into air runs off. None where nothing looks different.
        """
        if not seconds > 0.0 or float(self._distance.sample(place_mm)) < 0.0:
            return None
        more = ML_PER_S * seconds
        last = self.depots[-1] if self.depots else None
        if last is not None and math.dist(last.place_mm, place_mm) <= MERGED_MM:
            grown = InjectionSite(last.place_mm, last.ml + more)
            self.depots = (*self.depots[:-1], grown)
        else:
            x, y, z = place_mm.tolist()
            self.depots = (*self.depots, InjectionSite((x, y, z), more))
            self._drawn = 0
        depot = self.depots[-1]
        # what rounding took from a sum of many must not cost a step
        steps = math.floor(depot.ml / DRAWN_ML + 1e-6)
        if steps == self._drawn:
            return None
        self._drawn = steps
        return self._draw(depot, steps * DRAWN_ML)

    def checkpoint(self) -> InjectionState:
        """Return all that later samples may change."""
        voxels = np.flatnonzero(self._pale) if self.depots else np.zeros(0, np.int64)
        pale = self._pale.reshape(-1)[voxels]
        return InjectionState(voxels, pale, self.depots, self._drawn)

    def restore(self, state: InjectionState) -> Box | None:
        """Make it what it was; return what is drawn anew, None for nothing."""
        if state.depots == self.depots and state.drawn == self._drawn:
            return None
        flat = self._pale.reshape(-1)
        before = np.flatnonzero(flat)
        flat[before] = 0
        flat[state.voxels] = state.pale
        self.depots, self._drawn = state.depots, state.drawn
        changed = np.union1d(before, state.voxels)
        if not len(changed):
            return None
        k, j, i = np.unravel_index(changed, self._pale.shape)
        ends = [(int(a.min()), int(a.max())) for a in (i, j, k)]
        low, high = np.array(ends, np.int64).T
        return low, high

    def _draw(self, depot: InjectionSite, ml: float) -> Box:
        """Pale the tissue round a depot that hangs together with it."""
        volume = self._distance
        radius = radius_mm(ml)
        matrix = volume.voxel_from_world
        middle = matrix[:3, :3] @ np.array(depot.place_mm) + matrix[:3, 3]
        reach = radius / volume.spacing_mm + 1.0
        top = np.array(volume.shape[::-1]) - 1
        low = np.clip(np.floor(middle - reach), 0, top).astype(np.int64)
        high = np.clip(np.ceil(middle + reach), 0, top).astype(np.int64)
        here = tuple(slice(low[a], high[a] + 1) for a in (2, 1, 0))
        axes = [
            (np.arange(low[a], high[a] + 1) - middle[a]) * volume.spacing_mm[a]
            for a in range(3)
        ]
        x, y, z = axes[0], axes[1][:, None], axes[2][:, None, None]
        away = np.sqrt(x * x + y * y + z * z)
        tissue = (volume.values[here] > 0.0) & (away <= radius)
        numbers, _ = ndimage.label(tissue)
        at = np.unravel_index(int(np.where(tissue, away, np.inf).argmin()), away.shape)
        joined = numbers == numbers[at]
        # a surface is coloured by what lies on both sides of it
        joined = ndimage.binary_dilation(joined, iterations=2) & (away <= radius)
        share = np.clip((radius - away) / EDGE_MM, 0.0, 1.0)
        paled = np.rint(255.0 * share * share * (3.0 - 2.0 * share)).astype(np.uint8)
        part = self._pale[here]
        np.maximum(part, np.where(joined & tissue[at], paled, 0), out=part)
        return low, high


def radius_mm(ml: float) -> float:
    """Return how far a volume of fluid spreads in tissue."""
    return float(np.cbrt(3.0 * 1000.0 * ml / (4.0 * math.pi * SHARE)))
