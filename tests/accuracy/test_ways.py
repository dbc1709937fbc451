"""How wide the ways of the default head are, measured with balls on a fine grid."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.ethmoid import ethmoid
from anatomy.frame import lps_from_ras
from anatomy.parameters import PhantomParameters
from anatomy.phantom import Phantom, build_phantom
from anatomy.tissue import Label, Side

Voxel = tuple[int, ...]
FINE_MM = 0.35
"""A ball's centre is a voxel: radii come out too small, by up to half of this."""


@pytest.fixture(scope="module", params=[Side.RIGHT, Side.LEFT], ids=["right", "left"])
def half(request: pytest.FixtureRequest) -> tuple[Phantom, str]:
    """One side of the nose with what drains into it, and the side's name."""
    side: Side = request.param
    x = (0.3, 20.0) if side == Side.LEFT else (-20.0, -0.3)
    box = (x, (-17.0, 62.0), (-8.0, 68.0))
    return build_phantom(PhantomParameters(), FINE_MM, field_mm=box), side.name.lower()


def voxel_at(phantom: Phantom, place_mm: NDArray[np.floating], slack: int = 3) -> Voxel:
    """Find the most open voxel within `slack` voxels of a place."""
    d = phantom.distance.values
    at = np.round((place_mm - phantom.ct.origin_mm) / phantom.spacing_mm)[::-1]
    cut = tuple(slice(max(int(a) - slack, 0), int(a) + slack + 1) for a in at)
    inner = np.unravel_index(int(np.argmin(d[cut])), d[cut].shape)
    return tuple(c.start + int(i) for c, i in zip(cut, inner, strict=True))


def deepest(phantom: Phantom, label: Label) -> Voxel:
    """Find the most open voxel of a label."""
    d = np.where(phantom.labels.values == label, phantom.distance.values, np.inf)
    return tuple(int(i) for i in np.unravel_index(int(np.argmin(d)), d.shape))


def widest(phantom: Phantom, start: Voxel, goals: list[Voxel]) -> float:
    """Find the radius of the widest ball that passes from `start` to any goal."""
    low, high = 0.0, 6.0
    for _ in range(9):
        radius = 0.5 * (low + high)
        pieces, _ = ndimage.label(phantom.distance.values < -radius)
        joined = pieces[start] > 0 and any(pieces[start] == pieces[g] for g in goals)
        low, high = (radius, high) if joined else (low, radius)
    return low


def test_ways_of_a_decongested_nose_are_wide_enough(half: tuple[Phantom, str]) -> None:
    phantom, side = half
    at = {k: m.position_mm for k, m in phantom.landmarks.items()}
    nostril = voxel_at(phantom, at[f"nostril, {side}"])
    assert widest(phantom, nostril, [voxel_at(phantom, at[f"choana, {side}"])]) > 2.2
    meatus = voxel_at(phantom, at[f"middle meatus, {side}"])
    assert widest(phantom, nostril, [meatus]) >= 2.0


def test_ostia_have_published_diameters(half: tuple[Phantom, str]) -> None:
    phantom, side = half
    choana = voxel_at(phantom, phantom.landmarks[f"choana, {side}"].position_mm)
    for label, least, most in (
        (Label.MAXILLARY_AIR, 3.0, 5.0),
        (Label.SPHENOID_AIR, 2.0, 4.5),
        (Label.FRONTAL_AIR, 2.0, 6.0),
    ):
        way = 2 * widest(phantom, deepest(phantom, label), [choana])
        assert least <= way <= most, label.name


def test_scopes_come_as_near_to_ostia_as_in_an_unoperated_nose(
    half: tuple[Phantom, str],
) -> None:
    # The front of a scope is taken for a ball. A 4 mm scope sees the recess from
    # afar; a 2.7 mm scope comes to the ostium.
    phantom, side = half
    marks = phantom.landmarks
    start = voxel_at(phantom, marks[f"nostril, {side}"].position_mm)

    def nearest(diameter_mm: float, ostium: str) -> float:
        pieces, _ = ndimage.label(phantom.distance.values < -diameter_mm / 2)
        open_to = np.argwhere(pieces == pieces[start])[:, ::-1]
        place = phantom.ct.origin_mm + phantom.spacing_mm * open_to
        off = place - marks[f"{ostium} ostium, {side}"].position_mm
        return float(np.linalg.norm(off, axis=1).min())

    assert nearest(4.0, "maxillary") > 4.0
    assert nearest(4.0, "sphenoid") > 8.0
    assert nearest(2.7, "sphenoid") < 1.0


@pytest.mark.parametrize("side", [Side.RIGHT, Side.LEFT])
def test_ethmoid_cells_have_ostia_of_one_to_three_millimetres(side: Side) -> None:
    sign = 1.0 if side == Side.RIGHT else -1.0
    x = (-18.0, -4.0) if side == Side.RIGHT else (4.0, 18.0)
    parameters = PhantomParameters()
    box = (x, (12.0, 55.0), (20.0, 54.0))
    phantom = build_phantom(parameters, 0.25, field_mm=box)
    cells = ethmoid(parameters, side)
    for seeds in (cells.anterior_seeds, cells.posterior_seeds):
        places = np.array(seeds) * [sign, 1.0, 1.0]
        at = [voxel_at(phantom, place, 2) for place in lps_from_ras(places)]
        for i, cell in enumerate(at):
            others = [a for a in at if a != cell]
            assert 1.4 <= 2 * widest(phantom, cell, others) <= 3.0, i
