"""No splat whose footprint reaches a band is culled from it, in whatever view."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr.kernels.depth_sort import NOWHERE
from renderers.fsr.kernels.project_splats import project_splats
from renderers.fsr.kernels.tile_buffer import TILE_SHIFT
from renderers.fsr.kernels.view_planes import band_planes
from renderers.fsr.splats import SplatMode
from renderers.fsr.splats.set_view import view_set
from renderers.fsr.splats.shaded_set import ShadedSet
from renderers.fsr.splats.splat_list import list_splats
from renderers.fsr.view_bounds import lens_of
from renderers.scene import Camera, Projection
from tests.renderers.fsr.splat_scenes import blob, from_anywhere


@given(
    seed=st.integers(0, 10**6),
    far=st.sampled_from([0.0, 2.0, 6.0, 12.0, 60.0]),
    projection=st.sampled_from(list(Projection)),
    mode=st.sampled_from(list(SplatMode)),
    cuts=st.tuples(st.integers(0, 17), st.integers(1, 18)),
)
def test_what_reaches_a_band_is_on_its_list(
    seed: int,
    far: float,
    projection: Projection,
    mode: SplatMode,
    cuts: tuple[int, int],
) -> None:
    """And so is all that is near, which is drawn by other laws."""
    shaded = ShadedSet(*blob(seed % 3))
    rng = np.random.default_rng(seed)
    camera = from_anywhere(rng, far, projection, (65, 97), (160, 193))
    seen = view_set(shaded, camera, mode)
    every = len(seen.all_tiles)
    band = range(min(cuts) * every // 18, max(min(cuts) + 1, max(cuts)) * every // 18)
    whole = list_splats(seen, seen.all_tiles)
    some = list_splats(seen, band)
    listed, kept = (
        np.concatenate([np.empty(0, int)] + [np.arange(a, b) for _, a, b in found])
        for found in (whole.culled.spans, some.culled.spans)
    )
    assert set(kept) <= set(listed)
    assert np.array_equal(some.culled.near.places, whole.culled.near.places)
    n = len(listed)
    # vectors read and write sixteen at a time
    index = np.append(listed, np.zeros(16)).astype(np.int32)
    ranges, boxes = np.empty(n + 16, np.int32), np.empty((n + 16, 4), np.int32)
    project_splats(
        index, n, shaded.splats, False, seen.view, seen.style,
        np.empty((n + 16, 16), np.float32), boxes, ranges,
    )  # fmt: skip
    boxes, ranges = boxes[:n], ranges[:n]
    distance = np.linalg.norm(
        shaded.sparse.centers_mm()[listed] - camera.eye_mm, axis=1
    )
    upper, lower = boxes[:, 1] & 0xFFFF, boxes[:, 1] >> 16
    # rounding may move a depth across the limit either way
    is_far = distance > seen.view.near_mm + 1e-4
    across = seen.tiles[1]
    shows = (ranges != NOWHERE) & is_far
    shows &= lower >> TILE_SHIFT >= band.start // across
    shows &= upper >> TILE_SHIFT <= (band.stop - 1) // across
    assert set(listed[shows]) <= set(kept)


def bound(camera: Camera, lines: range, *lengths_mm: float) -> NDArray[np.float64]:
    """Bound lines of a camera's picture."""
    return band_planes(lens_of(camera), lines.start, lines.stop, *lengths_mm)


@pytest.mark.parametrize("projection", Projection)
def test_bands_far_away_leave_most_of_the_rest_out(projection: Projection) -> None:
    """Points all over a far view: those kept for a tenth of it are not many more."""
    flat = projection is Projection.ORTHOGRAPHIC
    extent = 20.0 if flat else 0.2
    camera = Camera.looking_at(
        (0, -100, 0), (0, 0, 0), extent=extent, size=(400, 400), projection=projection
    )
    rng = np.random.default_rng(1)
    points = rng.uniform(-16, 16, (4000, 3))
    planes = bound(camera, range(120, 160), 0.5, 5.0, 60.0)
    seen = (points - camera.eye_mm) @ camera.frame[1:].T
    kept = np.all(seen @ planes[:, :3].T + planes[:, 3] >= 0, axis=1)
    line = 200 - 200 * points[:, 2] / (100 + points[:, 1]) / math.tan(0.2)
    if flat:
        line = 200 - 200 * points[:, 2] / 20
    inside = (line >= 120) & (line < 160)
    assert np.all(kept[inside])
    assert np.count_nonzero(kept) < 2 * np.count_nonzero(inside)


def test_what_has_no_bound_is_not_cut() -> None:
    wide = Camera.looking_at((0, -9, 0), (0, 0, 0), extent=1.5, size=(90, 90))
    assert len(bound(wide, range(0, 32), 0.5, 5.0, 1.0)) == 0
    pinhole = Camera.looking_at(
        (0, -9, 0), (0, 0, 0), extent=0.7, size=(90, 90),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    # a splat as large as its distance
    assert len(bound(pinhole, range(0, 32), 0.5, 0.5, 0.5)) == 0
