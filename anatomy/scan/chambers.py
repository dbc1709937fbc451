"""The wide air spaces of a scanned head: sinuses, whether or not their ostia show.

A scan of a millimetre closes some ostia and opens others, so that a sinus may be one
air with the nasal passages. Width separates them: a ball that fits into a sinus does
not fit between septum and turbinates.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.scan.airways import CAVITY_MM3, Airways, part_middles
from anatomy.scan.midplane import Midplane
from anatomy.tissue import Side
from renderers.scene.volume import Volume

BALL_MM = 4.0
"""Radius of the ball that fits into a chamber, and not between the nasal walls: the
phantom's passages take 3.1 mm at most before the nasopharynx."""

CORNERS_MM = 2.0
"""How far a chamber reaches beyond the balls: into its corners, and its ostium."""

CHAMBER_MM3 = 500.0

ASIDE_MM = 6.0
"""A chamber whose middle is nearer to the head's midplane belongs to no side."""

SINUS_ASIDE_MM = 12.0
"""Wide places of the nose itself lie nearer to the midplane."""

LOOK_MM = 1.0

PASSAGES = 1
"""Label of the airway less its chambers."""


def side_of(aside_mm: float) -> Side:
    """Return the side of a middle so far to the left of the midplane."""
    if abs(aside_mm) < ASIDE_MM:
        return Side.MIDLINE
    return Side.LEFT if aside_mm > 0 else Side.RIGHT


@dataclass(frozen=True, slots=True)
class Chamber:
    """Describe one wide or separate air space.

    aside_mm: how far its middle lies to the left of the midplane. is_open: it is one
    air with the nasal passages in this scan.
    """

    center_mm: NDArray[np.float64]
    volume_ml: float
    aside_mm: float
    is_open: bool

    @property
    def side(self) -> Side:
        """Return the side it belongs to."""
        return side_of(self.aside_mm)


@dataclass(frozen=True, slots=True)
class AirSpaces:
    """The inner air in parts.

    labels: uint8; 0 is no inner air, 1 the passages, 2 and more the chambers in their
    order, largest first.
    """

    labels: Volume
    chambers: tuple[Chamber, ...]

    def passages(self) -> NDArray[np.bool_]:
        """Mark the air through which the throat is reached: no chamber far aside."""
        near = (abs(c.aside_mm) < SINUS_ASIDE_MM for c in self.chambers)
        marked: NDArray[np.bool_] = np.array([False, True, *near])[self.labels.values]
        return marked


def find_chambers(airways: Airways, distance: Volume, midplane: Midplane) -> AirSpaces:
    """Part the air of a head into passages and chambers.

    distance: signed mm to the air surface, negative in air, on the airways' grid.
    """
    spacing = float(distance.spacing_mm[0])
    found = np.asarray(airways.labels.values)
    airway = found == 1
    parts, count = _open_chambers(airway, distance)
    # closed cavities are numbered on after the open chambers
    every = np.where(found > 1, found.astype(np.int32) - 1 + count, parts)
    volumes = np.bincount(every.ravel()) * spacing**3
    volumes[0] = 0
    wanted = [int(p) for p in np.argsort(-volumes, kind="stable")]
    wanted = [
        p for p in wanted if volumes[p] >= (CHAMBER_MM3 if p <= count else CAVITY_MM3)
    ][:254]
    middles = part_middles(every)
    centers = [distance.origin_mm + middles[p][::-1] * spacing for p in wanted]
    names = np.zeros(len(volumes), np.uint8)
    names[wanted] = np.arange(2, len(wanted) + 2)
    labels = names[every]
    labels[airway & (labels == 0)] = PASSAGES
    chambers = tuple(
        Chamber(
            center, float(volumes[p]) / 1000, float(midplane.aside(center)), p <= count
        )
        for p, center in zip(wanted, centers, strict=True)
    )
    return AirSpaces(distance.with_values(labels, 0.0), chambers)


def _open_chambers(
    airway: NDArray[np.bool_], distance: Volume
) -> tuple[NDArray[np.int32], int]:
    """Number the chambers that are one air with the passages, on the same grid.

    Looked for on voxels of about a millimetre.
    """
    step = max(round(LOOK_MM / float(distance.spacing_mm[0])), 1)
    air = airway[::step, ::step, ::step]
    spacing = step * float(distance.spacing_mm[0])
    deep = air & (distance.values[::step, ::step, ::step] < -BALL_MM)
    parts, count = ndimage.label(deep)
    if not count:
        return np.zeros(airway.shape, np.int32), 0
    away = ndimage.distance_transform_edt(~deep) * spacing
    # all of a ball about a core is air: growing this far leads through no wall
    for within, reach in ((away <= BALL_MM, BALL_MM), (True, CORNERS_MM)):
        for _ in range(round(reach / spacing)):
            wider = ndimage.grey_dilation(parts, footprint=_CROSS)
            parts = np.where((parts == 0) & air & within, wider, parts)
    nearest = [
        np.minimum((np.arange(n) + step // 2) // step, m - 1)
        for n, m in zip(airway.shape, air.shape, strict=True)
    ]
    return np.where(airway, parts[np.ix_(*nearest)], 0), count


_CROSS = ndimage.generate_binary_structure(3, 1)
