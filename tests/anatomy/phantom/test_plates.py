"""Thin plates have their own thickness, whatever the voxel."""

from functools import cache

import numpy as np
import pytest
from scipy import ndimage

from anatomy.phantom.parameters import Opacity, PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.phantom.plates import (
    CRIBRIFORM_MM,
    FOVEA_MM,
    LAMINA_SHARE,
    LATERAL_LAMELLA_MM,
    plates,
)
from anatomy.queries.probing import plate_at
from anatomy.tissue import Label

STRAIGHT = PhantomParameters(septal_deviation_mm=0.0)
ROOF = ((-17.0, 17.0), (6.0, 58.0), (40.0, 60.0))
BONES = [label for label in Label if 20 <= label <= 30]


@cache
def roof_at(spacing_mm: float) -> Phantom:
    return build_phantom(STRAIGHT, spacing_mm, field_mm=ROOF)


@pytest.fixture(params=[0.25, 0.5])
def roof(request: pytest.FixtureRequest) -> Phantom:
    return roof_at(request.param)


def over_air(phantom: Phantom, aside: tuple[float, float]) -> list[tuple[int, int]]:
    """List columns ``(y, x)`` between two distances from the midline, 18 to 34 deep."""
    h, o = phantom.spacing_mm, phantom.ct.origin_mm
    _, ny, nx = phantom.ct.shape
    return [
        (j, i)
        for j in range(ny)
        for i in range(nx)
        if aside[0] < abs(o[0] + h * i) < aside[1] and 18 < o[1] + h * j < 34
    ]


def roof_mm(phantom: Phantom, aside: tuple[float, float]) -> np.ndarray:
    """Measure the bone over the topmost air, along the normal, from the coverage."""
    d, h = phantom.distance.values, phantom.spacing_mm
    rise = np.gradient(d, h, axis=0)
    reach = round(2.5 / h)
    found = []
    for j, i in over_air(phantom, aside):
        air = np.flatnonzero(d[:, j, i] < 0)
        if not len(air) or air[-1] + reach >= len(d):
            continue
        k = int(air[-1])
        if rise[k + 1, j, i] > 0.93:
            cover = phantom.bone_cover.values[k : k + reach, j, i] / 255.0
            found.append(h * cover.sum() * rise[k + 1, j, i])
    return np.array(found)


@pytest.mark.parametrize(
    ("aside", "expected"), [((7.0, 12.0), FOVEA_MM), ((1.2, 3.0), CRIBRIFORM_MM)]
)
def test_the_roof_has_its_plates_thickness_at_any_voxel(
    roof: Phantom, aside: tuple[float, float], expected: float
) -> None:
    found = roof_mm(roof, aside)
    assert len(found) > 50
    assert np.median(found) == pytest.approx(expected, rel=0.06)
    low, high = np.percentile(found, [10, 90])
    assert low > 0.8 * expected
    assert high < 1.3 * expected


def test_the_lateral_lamella_is_as_thin_as_it_is_said_to_be() -> None:
    roof = roof_at(0.25)
    d, h, o = roof.distance.values, roof.spacing_mm, roof.ct.origin_mm
    x = o[0] + h * np.arange(d.shape[2])
    across = np.gradient(d, h, axis=2)
    found = []
    for k in range(round((48.2 - o[2]) / h), round((49.8 - o[2]) / h)):
        for j in range(round((18.0 - o[1]) / h), round((34.0 - o[1]) / h)):
            for sign in (-1.0, 1.0):
                u = sign * x
                air = np.flatnonzero((d[k, j] < 0) & (u > 3.8) & (u < 7.0))
                if not len(air):
                    continue
                i = int(air[np.argmin(u[air])])
                if abs(across[k, j, i]) > 0.93:
                    wall = (u < u[i] + h / 2) & (u > u[i] - 2.6)
                    found.append(h * roof.bone_cover.values[k, j, wall].sum() / 255.0)
    assert len(found) > 100
    assert 0.05 < np.median(found) < 0.2
    assert np.percentile(found, 95) < 0.25


def test_a_plate_thinner_than_a_voxel_does_not_read_as_bone() -> None:
    roof = roof_at(0.5)
    peaks = []
    for j, i in over_air(roof, (1.2, 3.0)):
        air = np.flatnonzero(roof.distance.values[:, j, i] < 0)
        if len(air):
            peaks.append(roof.ct.values[air[-1] : air[-1] + 6, j, i].max())
    # 0.15 mm of 1500 HU behind a blur of 0.38 mm: about 15 % of bone.
    assert np.median(peaks) == pytest.approx(40 + 0.157 * 1460, abs=60)
    assert max(peaks) < 1000


def test_muscle_is_bright_only_beside_bone() -> None:
    half = build_phantom(
        PhantomParameters(), 0.5, field_mm=((-41.0, 2.0), (-10.0, 80.0), (-12.0, 70.0))
    )
    bone = ndimage.binary_dilation(
        np.isin(half.labels.values, BONES), np.ones((3,) * 3)
    )
    muscle = half.labels.values == Label.MUSCLE
    bright = muscle & (half.ct.values > 250) & ~bone
    assert np.count_nonzero(muscle) > 200_000
    assert np.count_nonzero(bright) / np.count_nonzero(muscle) < 0.003


def test_the_model_tells_each_plates_number() -> None:
    numbers = {p.name: p.thickness_mm for p in plates(STRAIGHT)}
    assert numbers == {
        "basal lamella": STRAIGHT.cell_bone_mm,
        "lamina papyracea": LAMINA_SHARE * STRAIGHT.cell_bone_mm,
        "fovea ethmoidalis": FOVEA_MM,
        "cribriform plate": CRIBRIFORM_MM,
        "lateral lamella": LATERAL_LAMELLA_MM,
    }
    # LPS: over the right cells, over the right olfactory cleft, in the maxilla's middle
    # and in the orbit, where there is no wall.
    at = np.array(
        [[-9.5, 28.0, 50.6], [-2.0, 26.0, 48.0], [-26.0, 28.0, 12.0], [-31.0, 10.0, 38]]
    )
    found = plate_at(STRAIGHT, at)
    assert found.name.tolist() == ["fovea ethmoidalis", "cribriform plate", "", ""]
    assert found.thickness_mm[:2] == pytest.approx([FOVEA_MM, CRIBRIFORM_MM])
    assert np.isnan(found.thickness_mm[2:]).all()
    assert plate_at(STRAIGHT, at.reshape(2, 2, 3)).name.shape == (2, 2)
    with pytest.raises(ValueError, match=r"shape \(..., 3\)"):
        plate_at(STRAIGHT, np.zeros(2))


def test_opaque_cells_keep_their_roof() -> None:
    full = Opacity(anterior_ethmoid=2, posterior_ethmoid=2, ostiomeatal=2)
    sick = PhantomParameters(septal_deviation_mm=0.0, opacity=(full, full))
    roof = build_phantom(sick, 0.5, field_mm=ROOF)
    columns = over_air(roof, (8.0, 11.0))
    z = roof.ct.origin_mm[2] + 0.5 * np.arange(roof.ct.shape[0])
    peaks = [roof.ct.values[(z > 48) & (z < 55), j, i].max() for j, i in columns]
    assert np.percentile(peaks, 10) > 400


def test_the_uncinate_process_stands_on_no_muscle() -> None:
    """Behind its walls, at most a rim of what lies beside it reads otherwise."""
    middle = ((-24.0, 24.0), (4.0, 62.0), (12.0, 60.0))
    head = build_phantom(PhantomParameters(), 0.5, field_mm=middle)
    kinds = head.layers.kinds
    its = [row for row, kind in enumerate(kinds) if kind.mucosa == Label.UNCINATE]
    behind = np.isin(head.layers.wall.values, its) & (head.distance.values > 1.1)
    assert np.count_nonzero(behind) > 500
    muscle = head.layers.ground.values[behind] == Label.MUSCLE
    assert np.count_nonzero(muscle) < 0.05 * muscle.size
