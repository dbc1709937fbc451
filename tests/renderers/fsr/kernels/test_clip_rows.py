"""Clipping loses nothing that a view may show."""

from collections.abc import Callable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr import FuzzySet
from renderers.fsr.display_list import clip_rows, view_planes
from renderers.fsr.footprint import CUT_SIGMAS, SHEET_SIGMA_PER_SPACING
from renderers.fsr.splats import SplatMode, Traversal
from renderers.fsr.splats.set_view import see_set
from renderers.fsr.splats.shaded_set import PaintedSet
from renderers.fsr.splats.splat_list import list_splats
from renderers.scene import Camera, Projection, Scene

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
    painted = PaintedSet(*blob(seed % 3))
    rng = np.random.default_rng(seed)
    camera = from_anywhere(rng, far, projection)
    seen = see_set(painted, camera, mode)
    best = list_splats(seen, seen.all_tiles)
    count = len(best.spans)
    # every element inside all planes is there, whole rows of the grid's order too
    center = painted.rows.centers_mm()
    margin_mm = CUT_SIGMAS * SHEET_SIGMA_PER_SPACING
    planes = view_planes(camera, margin_mm)
    inside = np.all(center @ planes[:, :3].T + planes[:, 3] >= 0, axis=1)
    listed = elements(best.spans)
    assert set(np.flatnonzero(inside)) <= set(listed)
    if mode is not SplatMode.SHEET:
        by_grid = see_set(painted, camera, mode, Traversal.GRID)
        grid = list_splats(by_grid, by_grid.all_tiles)
        assert set(elements(grid.spans)) == set(listed)
        assert len(grid.shells) == 0
        assert set(grid.given) <= set(listed)
        # in double precision a little less is kept, in the same order
        plain = clip_rows(painted.rows, camera, margin_mm).spans
        assert set(elements(plain)) <= set(listed)
        assert len(listed) - len(elements(plain)) <= 0.02 * len(painted.rows) + 5
        rows = np.searchsorted(painted.rows.offsets, grid.given[::-1], "right") - 1
        rows = rows[np.append(True, np.diff(rows) != 0)[: len(rows)]]
        common = plain[np.isin(plain[:, 0], rows), 0]
        np.testing.assert_array_equal(rows[np.isin(rows, plain[:, 0])], common)
    assert best.count == len(listed)
    depth = seen.view.matrix[:, :3] @ (painted.places[:, :3] - seen.view.base).T
    depth += seen.view.matrix[:, 3:]
    apart = depth[2] if seen.view.is_flat else np.linalg.norm(depth, axis=0)
    keys = np.clip((apart - seen.view.low) * seen.view.keys_per_mm, 0, 4095).astype(int)
    for (_, first, end), low, high in zip(
        best.spans, best.lowest[:count], best.highest[:count], strict=True
    ):
        assert low <= keys[first:end].min() + 1
        assert high >= keys[first:end].max() - 1
