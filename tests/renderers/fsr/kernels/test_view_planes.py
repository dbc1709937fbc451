"""No splat whose footprint reaches a band is culled from it, in whatever view."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderers.fsr.kernels.depth_sort import NOWHERE
from renderers.fsr.kernels.project_splats import project_splats
from renderers.fsr.kernels.tile_buffer import TILE_SHIFT
from renderers.fsr.splats import SplatMode
from renderers.fsr.splats.set_view import view_set
from renderers.fsr.splats.shaded_set import ShadedSet
from renderers.fsr.splats.splat_list import list_splats
from renderers.scene import Projection
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
