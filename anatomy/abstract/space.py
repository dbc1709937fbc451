"""An abstract space on a grid, with all that a head has: CT, labels, distance, tint."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.abstract.layout import Layout
from anatomy.redistance import DEEPEST_MM, FARTHEST_MM
from anatomy.scan.approach import Approach, air_reach
from anatomy.tissue import TISSUE_OF, Label
from renderers.scene.volume import AIR_HU, Volume
from system import UserError

LABELS = {Label.MUCOSA: "wall", Label.SEPTAL_CARTILAGE: "hoop"}
"""What walls and hoops are labelled as, so that tools cut them, and their names."""

DARK = 255
"""Blood code of dark paint and of hoops; bare walls have none."""

PLAIN = 100
"""Skin code of bare walls: dry and without vessels, so that nobody takes them for
mucosa. Hairs would grow on 154 and more, see `renderers.shading.strands`."""

LONGEST_MM = 100.0
"""Of the free way in that is looked for."""

_SMALLEST_MM, _LARGEST_MM = 0.2, 1.0

_NEAR_MM = 2.0
"""The tint is only seen at the surface."""


@dataclass(frozen=True, slots=True)
class AbstractSpace:
    """A space; all volumes share one grid in LPS.

    ct: int16 HU. labels: uint8 `Label`, see `LABELS`. distance: float32 mm to the air's
    surface, negative in air. blood, skin: uint8, as those of a phantom. landmarks:
    ``(3,)`` mm by name. way_in: where a scope enters.
    """

    ct: Volume
    labels: Volume
    distance: Volume
    blood: Volume
    skin: Volume
    landmarks: dict[str, NDArray[np.float64]]
    way_in: Approach


def build_space(layout: Layout, spacing_mm: float, mirror: float) -> AbstractSpace:
    """Sample a layout; mirror: -1 swaps left and right, 1 does not.

    UserError for a spacing outside [0.2, 1] mm.
    """
    if not _SMALLEST_MM <= spacing_mm <= _LARGEST_MM:
        raise UserError(
            f"the voxels of a scene must measure {_SMALLEST_MM:g} to {_LARGEST_MM:g} "
            f"mm, got {spacing_mm:g}"
        )
    x, y, z = _grid(layout, spacing_mm)
    seen_x = mirror * x
    places = seen_x, y[:, None], z[:, None, None]
    exact = layout.wall.distance_mm(*places)
    is_hoop = np.zeros(exact.shape, np.bool_)
    blood = np.zeros(exact.shape, np.uint8)
    for hoop in layout.hoops:
        depth = hoop.depth_mm(*places)
        exact = np.maximum(exact, depth)
        is_hoop |= depth > -_NEAR_MM / 2
    blood[is_hoop] = DARK
    near = (np.abs(exact) < _NEAR_MM) & ~is_hoop
    k, j, i = np.nonzero(near)
    at = np.stack([seen_x[i], y[j], z[k]], axis=1)
    dark = layout.stripes(at)
    for sign in layout.signs:
        dark = np.where(sign.covers(at), sign.paint(at, mirror, spacing_mm), dark)
    blood[near] = np.round(DARK * dark)
    labels = np.where(is_hoop, np.uint8(Label.SEPTAL_CARTILAGE), np.uint8(Label.MUCOSA))
    labels[exact < 0.0] = Label.NASAL_AIR
    ct = np.full(exact.shape, AIR_HU)
    for label, hu in ((m, TISSUE_OF[m].hu) for m in LABELS):
        # the share of a voxel behind the surface
        share = np.clip(0.5 + exact / spacing_mm, 0.0, 1.0)
        is_of = is_hoop if label is Label.SEPTAL_CARTILAGE else ~is_hoop
        ct = np.where(is_of, AIR_HU + share * (hu - AIR_HU), ct)
    origin = np.array([x[0], y[0], z[0]])

    def volume(values: NDArray[np.generic], background: float = 0.0) -> Volume:
        return Volume(values, np.full(3, spacing_mm), origin, background=background)

    clipped = np.clip(exact, DEEPEST_MM, FARTHEST_MM).astype(np.float32)
    distance = volume(clipped, FARTHEST_MM)
    swap = np.array([mirror, 1.0, 1.0])
    landmarks = {name: swap * place for name, place in layout.landmarks.items()}
    pivot = swap * layout.pivot
    axis = np.array([0.0, 1.0, 0.0])
    return AbstractSpace(
        volume(np.round(ct).astype(np.int16), AIR_HU),
        volume(labels),
        distance,
        volume(blood),
        volume(np.round(PLAIN * (1.0 - blood / DARK)).astype(np.uint8)),
        {"start": pivot, **landmarks},
        Approach(pivot, axis, air_reach(distance, pivot, axis, LONGEST_MM)),
    )


def _grid(
    layout: Layout, spacing_mm: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the voxels' x, y and z; x lies alike on both sides of 0."""
    half = math.ceil(layout.high[0] / spacing_mm)
    x = spacing_mm * np.arange(-half, half + 1)
    y, z = (
        layout.low[a]
        + spacing_mm
        * np.arange(math.ceil((layout.high[a] - layout.low[a]) / spacing_mm) + 1)
        for a in (1, 2)
    )
    return x, y, z
