"""Disease: polyps, thickened mucosa, fluid, cysts, or nothing left but content."""

from dataclasses import dataclass

import numpy as np

from anatomy.phantom.shapes import Ellipsoid, Field, bare, smooth_max, smooth_min, z
from anatomy.tissue import Label

SHELL_MM = 1.1
"""Mucosa and bone round a sinus that is painted as a solid."""

# of a partly opaque sinus: what fills it, with its share; thickening has the rest
_FLUID_SHARE, _CYST_SHARE = 0.35, 0.25
# floor of a sinus and height of its fluid level above it, mm
_LEVELS = {"maxillary": (-4.0, 11.0), "sphenoid": (24.5, 7.0), "frontal": (57.0, 6.0)}
_THICKENING_MM = {"anterior_ethmoid": 0.5, "posterior_ethmoid": 0.6}


@dataclass(frozen=True, slots=True)
class Content:
    """Name what fills a field's inside in place of air."""

    field: Field
    tissue: str
    label: Label


@dataclass(frozen=True, slots=True)
class Change:
    """Hold what is left of a part's air, and what took its place.

    air: None if no air is left. thickening_mm: swelling of the mucosa.
    """

    air: Field | None
    contents: tuple[Content, ...] = ()
    thickening_mm: float = 0.0


def contents_of(
    sinus: str, field: Field, is_duct: bool, score: int, rng: np.random.Generator
) -> Change:
    """Choose what a score makes of one part of a sinus.

    A duct of a partly opaque sinus stays open: swelling would close it.
    """
    if score == 2:
        dense = sinus in _LEVELS and rng.random() < 0.15
        tissue, label = (
            ("inspissated mucus", Label.INSPISSATED_MUCUS)
            if dense
            else ("mucus", Label.MUCUS)
        )
        if is_duct or sinus not in _LEVELS:
            tissue, label = "mucosa", Label.MUCOSA
        return Change(None, (Content(bare(field), tissue, label),))
    if is_duct:
        return Change(field)
    if sinus not in _LEVELS:
        swelling = _THICKENING_MM[sinus]
        return Change(field + swelling, (), swelling)
    kind = rng.random()
    floor, level = _LEVELS[sinus]
    if kind < _FLUID_SHARE:
        surface = floor + level * rng.uniform(0.6, 1.1)
        air = smooth_max(0.5, field, surface - z)
        return Change(air, (Content(bare(field), "mucus", Label.MUCUS),))
    if kind < _FLUID_SHARE + _CYST_SHARE and sinus == "maxillary":
        size = rng.uniform(6.0, 9.0)
        cyst = Ellipsoid(
            (22.0 + rng.uniform(-2, 2), -27.0 + rng.uniform(-4, 4), floor + 2.0),
            (size, size, 0.9 * size),
        )
        air = smooth_max(0.8, field, -cyst)
        return Change(air, (Content(bare(field), "mucus", Label.MUCUS),))
    swelling = float(rng.uniform(1.0, 1.8))
    return Change(field + swelling, (), swelling)


# centre (u, y, z) and radii, in the order in which a polyposis grows; each row with
# the grade from which it is there
_GROWTH = (
    (1, (8.6, -27.0, 22.6), (1.9, 3.2, 1.8)),
    (1, (8.8, -32.5, 22.0), (1.9, 3.0, 2.0)),
    (2, (8.4, -25.0, 18.6), (2.3, 4.2, 2.6)),
    (2, (8.8, -32.5, 18.4), (2.3, 4.0, 2.4)),
    (3, (6.0, -21.0, 15.0), (2.4, 4.2, 4.6)),
    (3, (6.2, -30.0, 13.0), (2.4, 5.2, 5.4)),
    (3, (6.0, -38.0, 10.0), (2.2, 4.6, 4.4)),
    (4, (5.4, -15.0, 9.5), (2.8, 6.0, 7.5)),
    (4, (5.4, -25.0, 6.0), (3.4, 7.0, 5.0)),
    (4, (5.4, -36.0, 6.5), (3.6, 7.0, 5.5)),
    (4, (4.0, -28.0, 21.0), (2.4, 8.0, 6.0)),
)


def polyps(grade: int) -> Field | None:
    """Unite the polyps of a grade from 1 to 4; grade 0 has none."""
    grown = [
        Ellipsoid(center, radii) for from_, center, radii in _GROWTH if from_ <= grade
    ]
    return smooth_min(1.2, *grown) if grown else None
