import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr.display_list import (
    build_display_list,
    sorted_by_distance,
    view_planes,
)
from renderers.fsr.sparse_rows import SparseRows
from renderers.scene import Camera, Projection

PROJECTIONS = st.sampled_from(list(Projection))
POINTS = st.tuples(*[st.floats(-12, 20) for _ in range(3)])


def random_rows(seed: int) -> SparseRows:
    rng = np.random.default_rng(seed)
    nz, ny, nx = rng.integers(3, 9, 3)
    filled = rng.random((nz, ny, nx)) < 0.4
    offsets = np.concatenate([[0], np.cumsum(filled.reshape(-1, nx).sum(axis=1))])
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = q * rng.uniform(0.4, 2, 3)
    matrix[:3, 3] = rng.uniform(-3, 3, 3)
    return SparseRows(
        (int(nz), int(ny), int(nx)),
        matrix,
        offsets.astype(np.int64),
        np.nonzero(filled)[2].astype(np.uint16),
    )


def aimed(
    eye: tuple[float, float, float], projection: Projection, extent: float = 0.6
) -> Camera:
    target = np.add(eye, (0.3, 1.0, -0.4))
    size = 4.0 if projection is Projection.ORTHOGRAPHIC else extent
    return Camera.looking_at(
        eye, target, extent=size, size=(48, 32), projection=projection
    )


def in_view(camera: Camera, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    pixel, _ = camera.project(points)
    column, row = pixel[:, 0], pixel[:, 1]
    with np.errstate(invalid="ignore"):
        inside = (column >= 0) & (column <= 48) & (row >= 0) & (row <= 32)
        if camera.projection is Projection.EQUIDISTANT:
            inside &= np.hypot(column - 24, row - 16) <= 16
    return inside


@given(seed=st.integers(0, 10**6), eye=POINTS, projection=PROJECTIONS)
def test_no_splat_whose_centre_is_in_view_is_dropped(
    seed: int, eye: tuple[float, float, float], projection: Projection
) -> None:
    rows = random_rows(seed)
    camera = aimed(eye, projection)
    shown = build_display_list(rows, camera, 0.0)
    wanted = np.flatnonzero(in_view(camera, rows.centers_mm()))
    assert set(wanted) <= set(shown.index.tolist())


@given(
    seed=st.integers(0, 10**6),
    eye=POINTS,
    projection=PROJECTIONS,
    margin=st.floats(0, 2),
    reach=st.sampled_from([math.inf, 6.0]),
)
def test_culling_equals_brute_force_over_the_same_planes(
    seed: int,
    eye: tuple[float, float, float],
    projection: Projection,
    margin: float,
    reach: float,
) -> None:
    rows = random_rows(seed)
    camera = aimed(eye, projection)
    shown = build_display_list(rows, camera, margin, reach_mm=reach)
    planes = view_planes(camera, margin)
    p = rows.centers_mm()
    level = (p @ planes[:, :3].T + planes[:, 3]).min(axis=1)
    distance = np.linalg.norm(p - camera.eye_mm, axis=1)
    kept = (level >= 0) & (distance <= reach)
    doubtful = (np.abs(level) < 1e-4) | (np.abs(distance - reach) < 1e-4)
    listed = np.zeros(len(rows), bool)
    listed[shown.index] = True
    assert len(shown.index) == listed.sum()
    assert np.array_equal(listed | doubtful, kept | doubtful)
    k, j = shown.row // rows.shape[1], shown.row % rows.shape[1]
    voxel = rows.voxels()[shown.index]
    np.testing.assert_array_equal(voxel[:, 1:], np.stack([j, k], -1))


@given(seed=st.integers(0, 10**6), eye=POINTS)
def test_nothing_precedes_what_it_could_hide(
    seed: int, eye: tuple[float, float, float]
) -> None:
    """Seen from the eye's voxel, order follows |i|, |j|, |k| on each side."""
    rows = random_rows(seed)
    camera = aimed(eye, Projection.EQUIDISTANT, math.pi / 2)
    shown = build_display_list(rows, camera, 50.0)
    assert len(shown) == len(rows)
    inverse = np.linalg.inv(rows.world_from_voxel)
    at = inverse[:3, :3] @ camera.eye_mm + inverse[:3, 3]
    top = np.array(rows.shape[::-1]) - 1
    cell = np.clip(np.rint(at), 0, top)
    offset = rows.voxels()[shown.index] - cell
    step, sign = np.abs(offset), np.sign(offset)
    for later in range(1, len(offset)):
        # an earlier one that is nearer on all axes and on no other side may hide it
        near = np.all(step[:later] <= step[later], axis=1)
        beside = np.all((sign[:later] == sign[later]) | (offset[:later] == 0), axis=1)
        assert not np.any(near & beside)


@given(seed=st.integers(0, 10**6))
def test_orthographic_order_runs_along_the_view(seed: int) -> None:
    rows = random_rows(seed)
    camera = aimed((0.0, 0.0, 0.0), Projection.ORTHOGRAPHIC)
    shown = build_display_list(rows, camera, 100.0)
    along = np.linalg.inv(rows.world_from_voxel)[:3, :3] @ camera.frame[3]
    step = rows.voxels()[shown.index] * np.sign(along)
    for later in range(1, len(step)):
        hides = np.all(step[:later] <= step[later], axis=1)
        assert not np.any(hides)


@given(seed=st.integers(0, 10**6), eye=POINTS)
def test_front_to_back_is_the_exact_reverse(
    seed: int, eye: tuple[float, float, float]
) -> None:
    rows = random_rows(seed)
    camera = aimed(eye, Projection.PERSPECTIVE)
    back = build_display_list(rows, camera, 1.0)
    front = build_display_list(rows, camera, 1.0, back_to_front=False)
    np.testing.assert_array_equal(back.index[::-1], front.index)
    np.testing.assert_array_equal(back.row[::-1], front.row)


@pytest.mark.parametrize("projection", list(Projection))
def test_a_margin_moves_every_plane_by_its_length(projection: Projection) -> None:
    camera = aimed((1.0, 2.0, 3.0), projection)
    planes = view_planes(camera, 0.0)
    np.testing.assert_allclose(np.linalg.norm(planes[:, :3], axis=1), 1)
    np.testing.assert_allclose(view_planes(camera, 2.5)[:, 3] - planes[:, 3], 2.5)


@given(seed=st.integers(0, 10**6), eye=POINTS, projection=PROJECTIONS)
def test_sorting_by_distance_keeps_the_elements_and_orders_them(
    seed: int, eye: tuple[float, float, float], projection: Projection
) -> None:
    rows = random_rows(seed)
    camera = aimed(eye, projection)
    shown = build_display_list(rows, camera, 1.0)
    ordered = sorted_by_distance(shown, rows, camera)
    if projection is Projection.ORTHOGRAPHIC:
        assert ordered is shown
        return
    assert sorted(ordered.index) == sorted(shown.index)
    where = np.searchsorted(rows.offsets, ordered.index, side="right") - 1
    np.testing.assert_array_equal(ordered.row, where)
    distance = np.linalg.norm(rows.centers_mm()[ordered.index] - camera.eye_mm, axis=1)
    assert np.all(np.diff(distance) < 2e-3)
