"""Disease: polyps, thickened mucosa, fluid, cysts, or nothing left but content."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from anatomy.phantom.fixed_shapes import POLYPS
from anatomy.phantom.parameters import FLUID_SINUSES, Finding, FindingKind
from anatomy.phantom.program import Row
from anatomy.phantom.shapes import (
    Ellipsoid,
    Field,
    Mark,
    bare,
    smooth_max,
    smooth_min,
    y,
    z,
)
from anatomy.tissue import Label, Side

SHELL_MM = 1.1
"""Mucosa and bone round a sinus that is painted as a solid."""

THIN_SWELLING_MM = 1.8
"""A lining swollen by more is painted as a solid: walls reach no deeper."""

# of a partly opaque sinus: what fills it, with its share; thickening has the rest
_FLUID_SHARE, _CYST_SHARE = 0.35, 0.25
_THICKENING_MM = {"anterior_ethmoid": 0.5, "posterior_ethmoid": 0.6}

_ROOM_MM = {
    "maxillary": ((11, 46), (-56, 0), (-14, 34)),
    "sphenoid": ((0, 24), (-92, -48), (16, 52)),
    "frontal": ((0, 36), (-22, 8), (46, 94)),
}
"""Where each sinus of one space lies, u, y, z."""

_SAMPLE_MM, _FAR_MM = 1.25, 1e3


@dataclass(frozen=True, slots=True)
class Content:
    """Name what fills a field's inside in place of air.

    has_shell: whether the sinus's own wall of bone is painted round it.
    """

    field: Field
    tissue: str
    label: Label
    has_shell: bool = False


@dataclass(frozen=True, slots=True)
class Change:
    """What is left of a part's air, and what took its place.

    air: None if no air is left. thickening_mm: swelling of the mucosa.
    """

    air: Field | None
    contents: tuple[Content, ...] = ()
    thickening_mm: float = 0.0


@dataclass(frozen=True, slots=True)
class Disease:
    """What is to become of one sinus. posture: see `PhantomParameters`."""

    sinus: str
    findings: tuple[Finding, ...]
    posture: str
    is_full: bool


def drawn_findings(
    sinus: str, side: Side, rng: np.random.Generator
) -> tuple[Finding, ...]:
    """Draw what makes a sinus partly opaque, a Lund-Mackay score of 1."""

    def finding(kind: FindingKind, size: float) -> tuple[Finding, ...]:
        name: Literal["left", "right"] = "left" if side == Side.LEFT else "right"
        return (Finding(kind=kind, sinus=sinus, side=name, size=size),)

    if sinus not in FLUID_SINUSES:
        return finding("swelling", _THICKENING_MM[sinus])
    kind = rng.random()
    if kind < _FLUID_SHARE:
        return finding("fluid", float(rng.uniform(0.2, 0.5)))
    if kind < _FLUID_SHARE + _CYST_SHARE and sinus == "maxillary":
        return finding("cyst", float(rng.uniform(6.0, 9.0)))
    return finding("swelling", float(rng.uniform(1.0, 1.8)))


def contents_of(
    disease: Disease, field: Field, is_duct: bool, rng: np.random.Generator
) -> Change:
    """Choose what becomes of one part of a sinus.

    A duct of a partly opaque sinus stays open: swelling would close it.
    """
    sinus = disease.sinus
    if disease.is_full:
        dense = sinus in FLUID_SINUSES and rng.random() < 0.15
        tissue, label = (
            ("inspissated mucus", Label.INSPISSATED_MUCUS)
            if dense
            else ("mucus", Label.MUCUS)
        )
        if is_duct or sinus not in FLUID_SINUSES:
            return Change(None, (Content(bare(field), "mucosa", Label.MUCOSA),))
        return Change(None, (Content(bare(field), tissue, label, True),))
    air, thickening = field, 0.0
    contents: list[Content] = []
    for finding in sorted(disease.findings, key=lambda f: f.kind != "swelling"):
        size = finding.size
        if finding.kind == "swelling":
            air = air + size
            if size <= THIN_SWELLING_MM:
                thickening = size
                continue
            contents.append(Content(bare(field), "mucosa", Label.MUCOSA, True))
            continue
        room = _inside(bare(field), sinus)
        if finding.kind == "fluid":
            up = y if disease.posture == "supine" else z
            surface = fluid_level_mm(room, disease.posture, size)
            air = smooth_max(0.5, air, surface - up)
            depth = smooth_max(0.3, bare(field), up - surface)
            # Only what is wet is marked, not all that lies below the level; so far
            # from the greater of the two, the mark does not shape the air.
            air = smooth_max(0.0, air, Mark(Row.FLUID, depth) - _FAR_MM)
        else:
            cyst = _cyst(room, size, rng)
            air = smooth_max(0.8, air, -cyst)
            depth = smooth_max(0.3, bare(field), cyst)
        contents.append(Content(depth, "mucus", Label.MUCUS, True))
    return Change(air, tuple(contents), thickening)


def _inside(field: Field, sinus: str) -> NDArray[np.float64]:
    """Sample a sinus: the points ``(3, n)`` of a lattice that lie in it."""
    axes = [np.arange(low, high, _SAMPLE_MM) for low, high in _ROOM_MM[sinus]]
    points = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)
    found: NDArray[np.float64] = points[:, field.evaluate(points) < 0]
    return found


def fluid_level_mm(room: NDArray[np.float64], posture: str, share: float) -> float:
    """Find the height against gravity below which a share of a sinus lies, mm.

    room: ``(3, n)`` points u, y, z of the sinus. It is y of a supine head, whose face
    looks up, and z of an upright one.
    """
    return float(np.quantile(room[1 if posture == "supine" else 2], share))


def _cyst(
    room: NDArray[np.float64], radius_mm: float, rng: np.random.Generator
) -> Field:
    """Build a retention cyst: a dome on the floor of a sinus."""
    low = room[:, room[2] <= np.quantile(room[2], 0.06)]
    a, b, _ = low[:, rng.integers(low.shape[1])]
    center = float(a), float(b), float(room[2].min()) + 0.2 * radius_mm
    return Ellipsoid(center, (radius_mm, radius_mm, 0.9 * radius_mm))


def polyps(grade: int) -> Field | None:
    """Unite the polyps of a grade from 1 to 4; grade 0 has none."""
    grown = [polyp for from_, polyp in POLYPS if from_ <= grade]
    return smooth_min(1.2, *grown) if grown else None
