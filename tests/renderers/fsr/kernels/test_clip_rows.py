"""Clipping loses nothing that a view may show."""

from collections.abc import Callable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr import FuzzySet
from renderers.fsr.kernels.footprint import CUT
from renderers.fsr.splats import SplatMode, Traversal
from renderers.fsr.splats.set_view import CULLED_SIGMA, view_set
from renderers.fsr.splats.shaded_set import ShadedSet
from renderers.fsr.splats.splat_list import list_splats
from renderers.scene import Camera, Projection, Scene
from tests.renderers.fsr.plain_culling import view_planes

Splats = tuple[FuzzySet, Scene]


def elements(spans: NDArray[np.int32]) -> NDArray[np.int64]:
    """List the elements of spans."""
    parts = [np.arange(first, end, dtype=np.int64) for _, first, end in spans]
    return np.concatenate([np.empty(0, np.int64), *parts])


@given(
    seed=st.integers(0, 10**6),
    far=st.sampled_from([0.0, 3.0, 30.0, 3000.0]),
    projection=st.sampled_from(list(Projection)),
    mode=st.sampled_from(list(SplatMode)),
)
def test_what_the_view_may_show_is_kept_and_bounded(
    blob: Callable[..., Splats],
    from_anywhere: Callable[..., Camera],
    seed: int,
    far: float,
    projection: Projection,
    mode: SplatMode,
) -> None:
    shaded = ShadedSet(*blob(seed % 3))
    rng = np.random.default_rng(seed)
    camera = from_anywhere(rng, far, projection)
    seen = view_set(shaded, camera, mode)
    culled = list_splats(seen, seen.all_tiles).culled
    count = len(culled.spans)
    # every element inside all planes is there, and hardly any other
    center = shaded.sparse.centers_mm()
    planes = view_planes(camera, CUT * CULLED_SIGMA)
    inside = np.all(center @ planes[:, :3].T + planes[:, 3] >= 0, axis=1)
    listed = elements(culled.spans)
    assert set(np.flatnonzero(inside)) <= set(listed)
    assert len(listed) - inside.sum() <= 0.02 * len(shaded) + 5
    by_grid = view_set(shaded, camera, mode, Traversal.GRID)
    grid = list_splats(by_grid, by_grid.all_tiles)
    assert set(elements(grid.culled.spans)) == set(listed)
    assert len(grid.culled.slab_ends) == 0
    assert set(grid.order) <= set(listed)
    assert culled.listed == len(listed)
    depth = seen.view.matrix[:, :3] @ (shaded.splats.places[:, :3] - seen.view.base).T
    depth += seen.view.matrix[:, 3:]
    flat = projection is Projection.ORTHOGRAPHIC
    apart = depth[2] if flat else np.linalg.norm(depth, axis=0)
    keys = np.clip((apart - seen.view.low) * seen.view.keys_per_mm, 0, 4095).astype(int)
    for (_, first, end), low, high in zip(
        culled.spans, culled.lowest[:count], culled.highest[:count], strict=True
    ):
        assert low <= keys[first:end].min() + 1
        assert high >= keys[first:end].max() - 1
