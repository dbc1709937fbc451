"""Walls that are estimated from CT numbers, against those that the phantom has."""

import numpy as np
import pytest
from scipy.special import ndtr

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.scan.wall_estimate import UNCERTAINTY_MM, estimate_walls
from anatomy.wall_layers import WallLayers
from renderers.scene import Volume

ETHMOID = ((-24.0, 24.0), (4.0, 62.0), (16.0, 60.0))
THIN = ("lamina papyracea", "fovea ethmoidalis", "ethmoid septum", "uncinate process")


@pytest.fixture(scope="module")
def head() -> Phantom:
    noisy = PhantomParameters(ct_noise_hu=12.0)
    return build_phantom(noisy, 0.5, field_mm=ETHMOID)


@pytest.fixture(scope="module")
def found(head: Phantom) -> WallLayers:
    return estimate_walls(head.ct, head.distance, head.hazards)


def tables(layers: WallLayers) -> tuple[np.ndarray, np.ndarray]:
    mucosa, bone = np.moveaxis(layers.table()[layers.wall.values], -1, 0)
    return mucosa, bone


@pytest.mark.parametrize("name", THIN)
def test_thin_walls_are_found_where_they_are(
    head: Phantom, found: WallLayers, name: str
) -> None:
    kinds = np.array([kind.name for kind in head.layers.kinds])
    depth = head.distance.values
    at = (kinds[head.layers.wall.values] == name) & (depth >= 0) & (depth < 0.5)
    mucosa, bone = (layer[at] for layer in tables(head.layers))
    mucosa_found, bone_found = (layer[at] for layer in tables(found))
    assert np.mean(bone_found > 0) > 0.9
    assert np.median(mucosa_found) == pytest.approx(np.median(mucosa), abs=0.11)
    assert np.median(bone_found) == pytest.approx(np.median(bone), abs=0.11)
    middle = np.abs(mucosa_found + bone_found / 2 - mucosa - bone / 2)
    assert np.percentile(middle, 60) < UNCERTAINTY_MM


def test_a_wall_without_bone_has_none(head: Phantom) -> None:
    """Air in plain soft tissue."""
    depth = head.distance.values
    share = np.clip(0.5 + depth / 1.2, 0.0, 1.0)
    ct = head.ct.with_values((1040 * share - 1000).astype(np.int16), -1000.0)
    found = estimate_walls(ct, head.distance)
    surface = (depth >= 0) & (depth < 0.5)
    bone = tables(found)[1]
    assert np.mean(bone[surface] == 0.0) > 0.97


@pytest.mark.parametrize(("mucosa", "bone"), [(0.5, 0.3), (1.0, 0.4), (0.6, 1.4)])
def test_a_plane_wall_has_its_numbers_whatever_the_blur(
    mucosa: float, bone: float
) -> None:
    # tilted, so that the surface meets voxels in every way
    normal = np.array([0.93, 0.31, 0.2]) / np.linalg.norm([0.93, 0.31, 0.2])
    for blur in (0.3, 0.5):
        z, y, x = 0.5 * np.indices((40, 40, 40))
        depth = z * normal[0] + y * normal[1] + x * normal[2] - 11.0
        values = -1000 + 1040 * ndtr(depth / blur)
        plate = 1460 * (
            ndtr((depth - mucosa) / blur) - ndtr((depth - mucosa - bone) / blur)
        )
        # most of an airway has no bone near: there the blur is measured
        values[:, :, :12] += plate[:, :, :12]
        ct = Volume(np.rint(values).astype(np.int16), np.full(3, 0.5), np.zeros(3))
        distance = ct.with_values(depth.astype(np.float32), 6.0)
        layers = estimate_walls(ct, distance)
        surface = (depth >= 0) & (depth < 0.5)
        surface[:, :, 10:] = surface[:2] = surface[-2:] = surface[:, :2] = False
        surface[:, -2:] = surface[:, :, :2] = False
        mucosas, bones = (layer[surface] for layer in tables(layers))
        assert np.median(mucosas) == pytest.approx(mucosa, abs=0.2)
        assert np.median(bones) == pytest.approx(bone, abs=max(0.12, 0.15 * bone))


def test_it_says_that_it_is_uncertain_and_names_what_is_behind(
    found: WallLayers,
) -> None:
    assert found.source == "CT numbers"
    assert found.uncertainty_mm == UNCERTAINTY_MM > 0.0
    behind = {kind.name: kind.behind for kind in found.kinds}
    assert behind["lamina papyracea"] == "orbit"
    assert behind["fovea ethmoidalis"] == "skull base"
    assert len(found.kinds) < 256
