"""Disease of a sinus: thickened mucosa, fluid, cysts, or nothing left but content."""

from dataclasses import dataclass

import numpy as np

from anatomy.phantom.honeycomb import bare
from anatomy.phantom.shapes import Ellipsoid, Field, smooth_max, z
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
