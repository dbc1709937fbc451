import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.fsr.kernels.cones import aim_cones, trace_cones
from renderers.fsr.kernels.occlusion import BlockReach, flag_blocks
from renderers.fsr.surfels.occlusion_blocks import BLOCK_SHIFT, FAR, Blocks
from renderers.fsr.surfels.surfel_set import extract_surfels
from renderers.fsr.view_bounds import lens_of
from renderers.scene import Camera, Projection, Volume
from renderers.scene.thread_pool import ThreadPool


@pytest.mark.parametrize("projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE])
@settings(max_examples=10)
@given(
    x=st.floats(-9, -4), y=st.floats(-2, 2), z=st.floats(-2, 2), turn=st.floats(0, 6)
)
def test_every_ray_of_a_square_meets_tissue_before_the_square_ends(
    cavities: Volume,
    pool: ThreadPool,
    projection: Projection,
    x: float,
    y: float,
    z: float,
    turn: float,
) -> None:
    camera = Camera.looking_at(
        (x, y, z),
        (x + np.cos(turn), y + np.sin(turn), z + 0.1),
        size=(32, 32),
        projection=projection,
    )
    limits, first = cone_ends_and_first_tissue(
        cavities, camera, np.arange(0.1, 22, 0.1)
    )
    assert np.all(first <= limits + 0.1)
    assert np.isfinite(limits).any()


@settings(max_examples=10)
@given(turn=st.floats(0, 6), lift=st.floats(-0.9, 0.9), away=st.floats(26, 60))
def test_cones_from_outside_begin_where_they_enter_the_grid(
    cavities: Volume, turn: float, lift: float, away: float
) -> None:
    out = np.array([np.cos(turn), np.sin(turn), lift])
    eye = away * out / np.linalg.norm(out)
    camera = Camera.looking_at(eye, (0, 0, 0), extent=0.2, size=(32, 32))
    depths = np.arange(0.1, away + 20, 0.1)
    limits, first = cone_ends_and_first_tissue(cavities, camera, depths)
    # also where it hides nothing, a cone is not taken for one that does
    assert np.all(first <= limits + 0.1)
    assert np.isfinite(limits).any()


def cone_ends_and_first_tissue(
    volume: Volume, camera: Camera, depths: NDArray[np.float64]
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Give, per ray of a 32 x 32 picture, its cone's end and its first tissue (mm)."""
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3] = camera.frame[1:]
    camera_from_world[:3, 3] = -camera.frame[1:] @ camera.eye_mm
    voxel_from_camera = np.linalg.inv(camera_from_world @ volume.world_from_voxel)
    cones = np.empty((5, 8, 8), np.float32)
    aim_cones(lens_of(camera), 4, cones)
    ends = np.empty((8, 8), np.float32)
    trace_cones(
        volume.values,
        np.ascontiguousarray(voxel_from_camera[:3], np.float32),
        cones,
        np.float32(0.125),
        0,
        8,
        ends,
    )
    origin, ray = camera.rays()
    seen = np.any(ray != 0, axis=-1)
    points = origin[seen][:, None, :] + depths[:, None] * ray[seen][:, None, :]
    tissue = volume.sample(points) > 0
    first = np.where(tissue.any(axis=-1), depths[np.argmax(tissue, axis=-1)], np.inf)
    limit = np.repeat(np.repeat(ends, 4, axis=0), 4, axis=1)
    return limit[seen], first


def test_runs_hold_every_element_of_the_visible_blocks_once_and_near_ones_first(
    cavities: Volume, pool: ThreadPool
) -> None:
    surfels = extract_surfels(cavities)
    blocks = Blocks(cavities, surfels.rows, surfels.rows)
    order = blocks.sort(surfels.rows, BLOCK_SHIFT)
    voxels = surfels.rows.voxels()[order.index]
    assert np.array_equal(np.sort(order.index), np.arange(len(surfels)))
    # a row of the grid counts in every block that it passes
    rows = np.column_stack([voxels[:, 0] >> BLOCK_SHIFT, voxels[:, 1:]])
    camera = Camera.looking_at((-6.0, 0.5, 0.2), (5.0, 0.0, 0.0), size=(64, 64))
    visible = blocks.visible(
        camera, pool, radius_mm=1.0, near_reach_mm=0.0, far_from_mm=4.0
    )
    spans = order.spans
    runs = blocks.runs(visible, FAR, spans, 100)
    assert 0 < runs.rows < spans.rows.sum() == len(np.unique(rows, axis=0))
    shown = np.concatenate([np.arange(a, b) for a, b in runs.runs])
    assert len(shown) == len(np.unique(shown)) == len(runs)
    wanted = np.flatnonzero(visible.shown & FAR)
    each = [np.arange(spans.begins[n], spans.ends[n]) for n in wanted]
    assert np.array_equal(np.sort(shown), np.sort(np.concatenate(each)))
    lengths = np.diff(runs.cuts[:, 1])
    assert np.all(lengths[:-1] >= 100)
    assert np.all(np.diff(runs.cuts[:, 0]) > 0)
    centres = surfels.rows.centers_mm()[order.index]
    distance = np.linalg.norm(centres - camera.eye_mm, axis=1)
    first = np.array([distance[a:b].mean() for a, b in runs.runs])
    # blocks are sorted by their middles in steps; they are 2 mm wide
    assert np.all(np.diff(first) > -2.5)
    assert first[-1] > first[0] + 10


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), extent=st.floats(0.2, 1.2))
def test_a_block_is_hidden_where_no_square_that_its_ball_meets_ends_behind_it(
    seed: int, extent: float
) -> None:
    random = np.random.default_rng(seed)
    count, squares, side = 400, 12, 8
    size = squares * side
    camera = Camera.looking_at((0, 0, 0), (0, 1, 0), extent=extent, size=(size, size))
    frame = np.eye(4)
    middles = random.normal(0, 12, (3, count))
    middles[2] += 25
    radius = float(random.uniform(0.3, 4))
    coarse = np.repeat(np.repeat(random.uniform(5, 60, (3, 3)), 4, axis=0), 4, axis=1)
    ends = np.asarray(coarse + random.uniform(0, 4, coarse.shape), np.float32)
    shown = np.zeros(count, np.uint8)
    everywhere = np.array([[0.0, 0, 0, 1]])
    met, hidden = flag_blocks(
        middles, 0, count, frame, everywhere, BlockReach(radius, 0.0, 0.0),
        lens_of(camera), side, ends, np.ones(count, np.uint8), shown,
        np.zeros(count, np.float32),
    )  # fmt: skip
    x, y, z = middles
    distance, rho = np.linalg.norm(middles, axis=0), np.hypot(x, y)
    theta = np.arctan2(rho, z)
    reach = np.where(
        distance > 1.01 * radius, np.arcsin(np.minimum(radius / distance, 1)), 1.6
    )
    scale = size / 2 / extent
    spread = scale * reach * np.maximum((theta + reach) / np.sin(theta + reach), 1)
    column, row = size / 2 + scale * theta * x / rho, size / 2 - scale * theta * y / rho
    blocked = np.zeros(count, np.bool_)
    for n in np.flatnonzero(theta + reach < 2):
        rows, columns = (
            slice(
                max(int((at[n] - spread[n]) // side), 0),
                max(int((at[n] + spread[n]) // side) + 1, 0),
            )
            for at in (row, column)
        )
        blocked[n] = not np.any(ends[rows, columns] >= distance[n] - radius)
    assert_array_equal(shown == 0, blocked)
    assert met == count
    assert hidden == blocked.sum()
