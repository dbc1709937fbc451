import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.fsr.deformation import SEAM_MM
from renderers.fsr.surfels import SurfelRasterizer
from renderers.scene import Camera, Volume
from renderers.scene.deflection import Cut, Deflection, Translation
from renderers.scene.thread_pool import ThreadPool

CUT = Cut(np.array([4.8, 0.0, 0.0]), 2.9, np.array([0.0, 1.0, 0.0]), 0.8)


def view() -> Camera:
    return Camera.looking_at((0.5, -1, 0.3), (6, 0.2, 0), size=(90, 90))


def test_pixels_beside_a_cut_are_where_tissue_begins(
    hollow: Volume, pool: ThreadPool
) -> None:
    """At each there is tissue within a hair, and air before it, rims and all."""
    deflection = Deflection((CUT,))
    drawer = SurfelRasterizer(hollow, deflection=deflection)
    found = drawer.draw(view(), pool)
    assert drawer.counters["cut rays traced"] > 1000
    assert drawer.counters["cut pixels corrected"] > 200
    origins, ways = view().rays()
    shown = found.coverage > 0
    depth = found.depth_mm[shown].astype(np.float64)
    x = origins[shown] + depth[:, None] * ways[shown]
    beside = deflection.opening(x) < SEAM_MM
    assert beside.sum() > 200

    def inside(x: NDArray[np.float64]) -> NDArray[np.float64]:
        seen = hollow.sample(deflection.pull_back(x))
        return np.asarray(np.minimum(seen, deflection.opening(x)))

    # depths are of float32
    assert np.abs(inside(x[beside])).max() < 1e-3
    before = x[beside] - 0.1 * ways[shown][beside]
    facing = np.einsum("ij,ij->i", found.normal[shown][beside], ways[shown][beside])
    assert np.all(inside(before[facing < -0.3]) < 0)
    length = np.linalg.norm(found.normal[shown], axis=-1)
    np.testing.assert_allclose(length, 1, atol=1e-4)


@pytest.mark.parametrize(
    "deflectors", [(), (Translation(CUT.center_mm, 2, np.array([0.3, 0, 0])),)]
)
def test_without_a_cut_no_pixel_is_asked(
    hollow: Volume, pool: ThreadPool, deflectors: tuple[Translation, ...]
) -> None:
    drawer = SurfelRasterizer(hollow, deflection=Deflection(deflectors))
    drawer.draw(view(), pool)
    assert drawer.counters["cut rays traced"] == 0
