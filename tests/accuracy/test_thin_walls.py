"""Walls thinner than a voxel: their CT numbers, their mass, and a real scan."""

import numpy as np
import pytest
from scipy import ndimage

from anatomy.coverage import blur_mm, weights
from anatomy.ethmoid import ethmoid_block, lamina_papyracea
from anatomy.frame import lps_from_ras
from anatomy.parameters import PhantomParameters
from anatomy.phantom import Phantom, build_phantom
from anatomy.tissue import TISSUES, Side

HU = np.array([TISSUES[n].hu for n in ("air", "mucosa", "thin bone", "fat")])


def smoothed_box(value: np.ndarray, step: float, h: float, sigma: float) -> np.ndarray:
    """Average along the last axis over a voxel, then blur by the scanner."""
    boxed = ndimage.uniform_filter1d(value, max(1, round(h / step)), axis=-1)
    blurred: np.ndarray = ndimage.gaussian_filter1d(boxed, sigma / step, axis=-1)
    return blurred


@pytest.mark.parametrize("h", [0.3, 0.5, 1.0])
@pytest.mark.parametrize("sigma", [0.25, 0.35, 0.6])
@pytest.mark.parametrize("bone", [0.2, 0.4, 0.8])
def test_a_wall_has_the_ct_numbers_of_finely_sampled_layers(
    h: float, sigma: float, bone: float
) -> None:
    # A septum between two airspaces, with mucosa on both sides, along its normal.
    mucosa, step = 0.4, 0.005
    total = 2 * mucosa + bone
    x = np.arange(-8.0, 8.0 + total, step)
    depth = np.minimum(x, total - x)
    layer = np.where(depth < 0, 0, np.where(depth < mucosa, 1, 2))
    exact = smoothed_box(HU[layer], step, h, sigma)
    blur = blur_mm(sigma, h)
    inside = slice(400, len(x) - 400, 20)
    found = np.array([weights(d, total, mucosa, bone / 2, blur) for d in x[inside]])
    assert found.sum(axis=1) == pytest.approx(1.0, abs=1e-5)
    near = np.abs(x[inside] - total / 2) < 3.0
    error = (found @ HU - exact[inside])[near]
    # The Gaussian stands for the voxel's box: exact enough while it is narrower than
    # the scanner's blur; a voxel of 1 mm with a sharp kernel is the worst case.
    limit = 15.0 if h <= 1.5 * sigma else 60.0
    assert np.sqrt(np.mean(error**2)) < limit
    assert np.percentile(np.abs(error), 99.9) < (120.0 if h <= 1.5 * sigma else 180.0)


def septum_peaks(phantom: Phantom) -> np.ndarray:
    """List CT numbers on the crests of walls inside the right ethmoid.

    The slices are 4 mm thick, as those of the scan.
    """
    h, o = phantom.spacing_mm, phantom.ct.origin_mm
    thick = ndimage.uniform_filter1d(
        phantom.ct.values.astype(float), round(4.0 / h), axis=0
    )
    index = np.indices(phantom.ct.shape).reshape(3, -1)
    place = lps_from_ras((o[:, None] + h * index[::-1]).T).T
    block = ethmoid_block(phantom.parameters, Side.RIGHT).evaluate(place)
    inside = (block < -1.8).reshape(phantom.ct.shape)
    # A peak is the maximum across a wall, 100 HU above what is on both sides.
    found = []
    for axis in (1, 2):
        crest = inside & (thick == ndimage.maximum_filter1d(thick, 7, axis=axis))
        beside = [
            ndimage.minimum_filter1d(thick, 7, axis=axis, origin=origin)
            for origin in (-3, 3)
        ]
        found.append(thick[crest & (thick - np.maximum(*beside) > 100)])
    return np.concatenate(found)


def test_ethmoid_septa_look_as_in_a_scan_with_a_standard_kernel() -> None:
    # A head CT (0.49 mm pixels, standard kernel, 4 mm slices) has septa with peaks of
    # median -254 HU (10-90 %: -533 to 39, 324 septa), and air of median -996 HU.
    box = ((-18.0, -3.0), (12.0, 56.0), (22.0, 54.0))
    head = PhantomParameters(edge_blur_mm=0.6, mucosa_mm=0.3)
    phantom = build_phantom(head, 0.5, field_mm=box)
    found = septum_peaks(phantom)
    assert len(found) > 300
    assert np.median(found) == pytest.approx(-254.0, abs=120.0)
    deep = phantom.distance.values < -2.5
    assert np.median(phantom.ct.values[deep]) == pytest.approx(-1000.0, abs=10.0)


@pytest.mark.parametrize("side", [Side.RIGHT, Side.LEFT])
def test_the_orbits_medial_wall_is_as_faint_as_in_a_scan(side: Side) -> None:
    # The same scan: peaks of median 40 to 66 HU in three slices (10-90 %: -80 to 730).
    sign = 1.0 if side == Side.LEFT else -1.0
    x = (3.0, 24.0) if side == Side.LEFT else (-24.0, -3.0)
    head = PhantomParameters(edge_blur_mm=0.6, mucosa_mm=0.3)
    phantom = build_phantom(head, 0.5, field_mm=(x, (12.0, 52.0), (22.0, 54.0)))
    h, o = phantom.spacing_mm, phantom.ct.origin_mm
    slab = round(4.0 / h)
    thick = ndimage.uniform_filter1d(phantom.ct.values.astype(float), slab, axis=0)
    deep = (phantom.distance.values < -0.4).astype(float)
    deep = ndimage.uniform_filter1d(deep, slab, axis=0)
    lateral = sign * (o[0] + h * np.arange(phantom.ct.shape[2]))
    lamina = lamina_papyracea(head, side)
    found = []
    for k in range(slab, phantom.ct.shape[0] - slab, slab // 2):
        for j in range(phantom.ct.shape[1]):
            y, z = -(o[1] + h * j), o[2] + h * k
            if not (-48 < y < -20 and 30 < z < 46):
                continue
            off = lateral - lamina.evaluate(np.array([[0.0], [y], [z]]))[0]
            # An aired cell beside the wall, through the whole thickness of the slice.
            if deep[k, j, (off > -3) & (off < -1)].max() > 0.95:
                found.append(thick[k, j, np.abs(off) < 2].max())
    assert len(found) > 100
    assert np.median(found) == pytest.approx(50.0, abs=60.0)
