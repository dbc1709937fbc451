"""Depth slabs, hidden splats and the grid's order change pictures as they may."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr import Inclusion, extract_fuzzy_set
from renderers.fsr.kernels.depth_slabs import select_slab
from renderers.fsr.splats import SplatMode, SplatRasterizer
from renderers.fsr.splats.set_view import Traversal, view_set
from renderers.fsr.splats.shaded_set import ShadedSet
from renderers.fsr.splats.splat_list import far_to_near, list_splats
from renderers.scene import Camera, Image, Projection, Scene, TransferFunction, Volume
from renderers.scene.thread_pool import ThreadPool
from tests.renderers.fsr.splat_scenes import Splats, blob


def wall() -> Splats:
    """Give a thick wall with a hole, so that some tiles end early and some never."""
    rng = np.random.default_rng(2)
    values = rng.uniform(60, 120, (24, 30, 36)).astype(np.float32)
    values[8:14, :, 12:18] = 0
    transfer = TransferFunction(
        np.array([0.0, 50.0, 120.0]), np.eye(3), np.array([0.0, 2.0, 9.0])
    )
    scene = Scene(Volume(values, np.ones(3), np.zeros(3)), transfer)
    return extract_fuzzy_set(scene.volume, Inclusion.density(0, 120), 50.0), scene


def no_planes(*lens: object) -> NDArray[np.float64]:
    """Cull nothing."""
    return np.empty((0, 4))


VIEWS = [((15.0, -9.0, 11.0), 0.8), ((15.0, 4.0, 11.0), 1.2), ((70.0, 50.0, 31.0), 0.3)]


def seen_from(
    eye: tuple[float, float, float], extent: float, projection: Projection
) -> Camera:
    flat = projection is Projection.ORTHOGRAPHIC
    return Camera.looking_at(
        eye,
        (15.5, 14.5, 11.5),
        extent=20.0 * extent if flat else extent,
        size=(150, 140),
        projection=projection,
    )


def equal_bits(
    a: Image, b: Image, where: NDArray[np.bool_] | slice = slice(None)
) -> bool:
    assert a.depth_mm is not None
    assert b.depth_mm is not None
    same = np.array_equal(
        a.depth_mm[where].view(np.uint32), b.depth_mm[where].view(np.uint32)
    )
    colors = a.rgba[where].view(np.uint32), b.rgba[where].view(np.uint32)
    return same and np.array_equal(*colors)


@pytest.mark.parametrize("mode", SplatMode)
def test_slabs_that_leave_hidden_splats_out_change_no_bit(
    pool: ThreadPool,
    three: ThreadPool,
    monkeypatch: pytest.MonkeyPatch,
    mode: SplatMode,
) -> None:
    drawer = SplatRasterizer(*wall())
    fewer = 0
    for projection in Projection:
        for eye, extent in VIEWS:
            camera = seen_from(eye, extent, projection)
            with monkeypatch.context() as patch:
                patch.setattr("renderers.fsr.splats.splat_list.SHARES", ())
                whole = drawer.draw(camera, pool, mode, with_depth=True)
            all_ = drawer.counters["visible"]
            with monkeypatch.context() as patch:
                patch.setattr("renderers.fsr.splats.splat_list.LEAST_SLAB", 1)
                patch.setattr("renderers.fsr.splats.splat_list.MANY", 1)
                bands = drawer.draw(camera, three, mode, with_depth=True)
                slabs = drawer.draw(camera, pool, mode, with_depth=True)
            assert whole.rgba[..., 3].max() > 0.9
            assert equal_bits(whole, slabs)
            assert equal_bits(whole, bands)
            assert drawer.counters["visible"] <= all_
            fewer += all_ - drawer.counters["visible"]
    assert fewer > 1000


@pytest.mark.parametrize("projection", Projection)
@pytest.mark.parametrize("traversal", Traversal)
def test_culling_rows_changes_no_bit(
    pool: ThreadPool,
    monkeypatch: pytest.MonkeyPatch,
    traversal: Traversal,
    projection: Projection,
) -> None:
    """Within the field of view; beyond a round one nothing is meant to be seen.

    From among the splats a pinhole needs the culling: the straight map would smear
    what is beside the eye over all of the picture. From 9 mm it still reaches in from
    beyond the edge with 6e-6.
    """
    fuzzy, scene = wall()
    drawer = SplatRasterizer(fuzzy, scene)
    views = [((15.0, -20.0, 11.0), 0.2), ((15.0, -40.0, 11.0), 0.1)]
    if projection is not Projection.PERSPECTIVE:
        views.append(((15.0, 4.0, 11.0), 0.4))
    culled = 0
    for mode in SplatMode:
        for eye, extent in views:
            camera = seen_from(eye, extent, projection)
            some = drawer.draw(camera, pool, mode, traversal, with_depth=True)
            assert some.rgba[..., 3].max() > 0.5
            counters = drawer.counters
            with monkeypatch.context() as patch:
                patch.setattr("renderers.fsr.splats.set_view.lens_planes", no_planes)
                whole = drawer.draw(camera, pool, mode, traversal, with_depth=True)
            seen = np.any(camera.lens_table() != 0, axis=-1)
            assert equal_bits(some, whole, seen)
            assert drawer.counters["culled rows"] == 0
            assert drawer.counters["listed"] == len(fuzzy) > counters["listed"]
            culled += counters["culled rows"]
    assert culled > 100


@given(
    seed=st.integers(0, 10**6),
    projection=st.sampled_from(list(Projection)),
    cuts=st.lists(st.integers(1, 4095), max_size=4),
    mode=st.sampled_from(list(SplatMode)),
)
def test_every_far_element_is_in_one_slab_and_near_ones_in_none(
    seed: int, projection: Projection, cuts: list[int], mode: SplatMode
) -> None:
    shaded = ShadedSet(*blob(seed % 5))
    eye = tuple(np.random.default_rng(seed).uniform(-9, 18, 3))
    camera = seen_from((eye[0], eye[1], eye[2]), 0.7, projection)
    seen = view_set(shaded, camera, mode)
    culled = list_splats(seen, seen.all_tiles).culled
    listed = np.concatenate(
        [np.arange(a, b) for _, a, b in culled.spans] or [np.empty(0, int)]
    )
    assert culled.listed == len(listed)
    ends = [0, *sorted(set(cuts)), 4096]
    taken: list[NDArray[np.int32]] = []
    for first, end in pairwise(ends):
        index, keys = np.full((2, culled.listed + 32), -7, np.int32)
        n = select_slab(
            culled.spans, culled.lowest, culled.highest, shaded.rows, seen.view,
            np.float32(1), first, end, np.empty(0, np.int32), index, keys,
        )  # fmt: skip
        assert np.all((keys[:n] >= first) & (keys[:n] < end))
        assert np.all(index[n:] == -7)
        taken.append(index[:n])
    distance = np.linalg.norm(
        shaded.sparse.centers_mm()[listed] - camera.eye_mm, axis=1
    )
    wanted = distance >= seen.view.near_mm
    doubtful = listed[np.abs(distance - seen.view.near_mm) < 1e-4]
    found = np.concatenate(taken)
    assert len(np.unique(found)) == len(found)
    assert set(found) - set(doubtful) == set(listed[wanted]) - set(doubtful)


@pytest.mark.parametrize("mode", [SplatMode.POINTS, SplatMode.GAUSSIAN])
def test_the_order_of_the_grid_differs_from_that_of_distance_only_in_order(
    pool: ThreadPool, mode: SplatMode
) -> None:
    """How much light is left does not depend on the order, but for rounding."""
    drawer = SplatRasterizer(*wall(), least_light=0.0)
    for projection in Projection:
        for eye, extent in VIEWS:
            camera = seen_from(eye, extent, projection)
            a, b = (
                drawer.draw_list(drawer.prepare(camera, mode, order), pool).rgba[..., 3]
                for order in Traversal
            )
            assert a.max() > 0.9
            np.testing.assert_allclose(a, b, atol=2e-6)


def far_first(
    seed: int, projection: Projection
) -> tuple[ShadedSet, Camera, NDArray[np.int32]]:
    shaded = ShadedSet(*blob(seed % 5))
    eye = tuple(np.random.default_rng(seed).uniform(-9, 18, 3))
    camera = seen_from((eye[0], eye[1], eye[2]), 0.7, projection)
    seen = view_set(shaded, camera, SplatMode.GAUSSIAN)
    return shaded, camera, far_to_near(list_splats(seen, seen.all_tiles))


@given(seed=st.integers(0, 10**6))
def test_far_splats_come_first(seed: int) -> None:
    shaded, camera, order = far_first(seed, Projection.PERSPECTIVE)
    assert len(np.unique(order)) == len(order)
    place = shaded.sparse.centers_mm()[order]
    distance = np.linalg.norm(place - camera.eye_mm, axis=1)
    assert np.all(np.diff(distance) < 2e-3)


@given(seed=st.integers(0, 10**6))
def test_in_a_flat_view_no_splat_precedes_one_that_it_could_hide(seed: int) -> None:
    shaded, camera, order = far_first(seed, Projection.ORTHOGRAPHIC)
    along = shaded.grid.voxel_from_world[:, :3] @ camera.frame[3]
    step = shaded.sparse.voxels()[order] * np.sign(along)
    for later in range(1, len(step)):
        assert not np.any(np.all(step[:later] <= step[later], axis=1))


@given(seed=st.integers(0, 10**6))
def test_in_the_grids_order_no_splat_precedes_one_that_hides_it(seed: int) -> None:
    """Seen from the eye's voxel, order follows |i|, |j|, |k| on each side."""
    shaded = ShadedSet(*blob(seed % 5))
    eye = tuple(np.random.default_rng(seed).uniform(-9, 18, 3))
    camera = seen_from((eye[0], eye[1], eye[2]), 0.7, Projection.EQUIDISTANT)
    seen = view_set(shaded, camera, SplatMode.GAUSSIAN, Traversal.GRID)
    order = list_splats(seen, seen.all_tiles).order[::-1]
    offset = shaded.sparse.voxels()[order] - seen.view.base
    step, sign = np.abs(offset), np.sign(offset)
    for later in range(1, len(offset)):
        # an earlier one that is nearer on all axes and on no other side may hide it
        near = np.all(step[:later] <= step[later], axis=1)
        beside = np.all((sign[:later] == sign[later]) | (offset[:later] == 0), axis=1)
        assert not np.any(near & beside)
