"""Laws of the camera: what `project` and `rays` say must be one and the same lens."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from renderers.scene import Camera, Distortion, Projection
from renderers.scene.camera import STOP_MARGIN_PX

ALL = list(Projection)
LENSES = [Projection.EQUIDISTANT, Projection.PERSPECTIVE]


def posed(
    projection: Projection,
    seed: int = 7,
    size: tuple[int, int] = (24, 18),
    extent: float = 0.7,
) -> Camera:
    rotation = Rotation.random(random_state=seed).as_matrix()
    eye = np.random.default_rng(seed).uniform(-50, 50, 3)
    frame = np.vstack([eye, rotation])
    return Camera(frame, extent, *size, projection)


def pixel_centers(camera: Camera) -> NDArray[np.float64]:
    column, row = np.meshgrid(
        np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5
    )
    return np.stack([column, row], axis=-1)


@pytest.mark.parametrize("projection", ALL)
@given(
    seed=st.integers(0, 10**6),
    width=st.integers(4, 40),
    height=st.integers(4, 40),
    extent=st.floats(0.05, 1.4),
    distance=st.floats(0.1, 500),
)
def test_a_point_on_a_ray_projects_to_the_rays_pixel(
    projection: Projection,
    seed: int,
    width: int,
    height: int,
    extent: float,
    distance: float,
) -> None:
    camera = posed(projection, seed, (width, height), extent)
    origins, directions = camera.rays()
    seen = np.linalg.norm(directions, axis=-1) > 0.5
    pixel, along = camera.project(origins + distance * directions)
    # The lens table is float32: 1e-7 of a direction is up to 1e-4 of a pixel here.
    np.testing.assert_allclose(
        pixel[seen], pixel_centers(camera)[seen], atol=2e-4, rtol=0
    )
    np.testing.assert_allclose(along[seen], distance, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("projection", ALL)
def test_some_rays_are_those_among_all(projection: Projection) -> None:
    camera = posed(projection)
    where = np.random.default_rng(2).uniform(size=(18, 24)) < 0.3
    for some, every in zip(camera.rays(where), camera.rays(), strict=True):
        assert some.shape == (where.sum(), 3)
        np.testing.assert_allclose(some, every[where], rtol=0, atol=1e-14)


@given(extent=st.floats(0.1, math.pi / 2), size=st.integers(8, 60))
def test_equidistant_angle_is_proportional_to_radius(extent: float, size: int) -> None:
    camera = posed(Projection.EQUIDISTANT, 3, (size + 5, size), extent)
    _, directions = camera.rays()
    offset = pixel_centers(camera) - np.array([camera.width, camera.height]) / 2
    radius_px = np.hypot(offset[..., 0], offset[..., 1])
    seen = np.linalg.norm(directions, axis=-1) > 0.5
    sine = np.linalg.norm(np.cross(directions, camera.frame[3]), axis=-1)
    angle = np.arctan2(sine, directions @ camera.frame[3])
    np.testing.assert_allclose(
        angle[seen], radius_px[seen] * camera.radians_per_pixel, atol=5e-7
    )
    stop = size / 2 + STOP_MARGIN_PX
    assert np.all(seen[radius_px < stop - 1e-9])
    assert not np.any(seen[radius_px > stop + 1e-9])


def test_perspective_keeps_straight_lines_straight() -> None:
    camera = posed(Projection.PERSPECTIVE, size=(40, 30))
    a, b = camera.frame[0] + 30 * camera.frame[3] + np.array([[3, 4, 1], [-5, 2, 6.0]])
    pixel, _ = camera.project(a + np.linspace(0, 1, 9)[:, None] * (b - a))
    along, away = pixel[-1] - pixel[0], pixel - pixel[0]
    cross = along[0] * away[:, 1] - along[1] * away[:, 0]
    assert np.abs(cross).max() < 1e-9


def test_orthographic_size_does_not_depend_on_distance() -> None:
    camera = posed(Projection.ORTHOGRAPHIC, extent=9.0)
    near = camera.frame[0] + camera.frame[1:3].T @ np.array([2.0, 1.0])
    pixel, along = camera.project(
        near + np.array([[0.0], [1.0], [70.0]]) * camera.frame[3]
    )
    np.testing.assert_allclose(pixel, np.broadcast_to(pixel[0], (3, 2)), atol=1e-12)
    np.testing.assert_allclose(along, [0, 1, 70], atol=1e-12)
    # 9 mm fall on the 9 pixels of half the shorter side
    np.testing.assert_allclose(pixel[0], [12 + 2, 9 - 1])


@pytest.mark.parametrize("projection", ALL)
@given(seed=st.integers(0, 10**6))
def test_turning_camera_and_world_together_changes_nothing(
    projection: Projection, seed: int
) -> None:
    camera = posed(projection)
    rotation = Rotation.random(random_state=seed).as_matrix()
    shift = np.random.default_rng(seed).uniform(-100, 100, 3)
    frame = camera.frame @ rotation.T
    frame[0] += shift
    moved = Camera(frame, camera.extent, camera.width, camera.height, projection)
    points = camera.frame[0] + np.random.default_rng(seed).uniform(-20, 20, (30, 3))
    before, after = camera.project(points), moved.project(points @ rotation.T + shift)
    np.testing.assert_allclose(after[0], before[0], atol=1e-6, rtol=1e-9)
    np.testing.assert_allclose(after[1], before[1], atol=1e-9)


@pytest.mark.parametrize("projection", ALL)
def test_looking_at_centres_the_target_with_up_upwards(projection: Projection) -> None:
    camera = Camera.looking_at(
        (10, -40, 5), (12, 30, 9), size=(64, 48), projection=projection
    )
    target = np.array([12.0, 30.0, 9.0])
    higher, left = target + np.array([0, 0, 1]), target + np.array([1, 0, 0])
    pixel, distance = camera.project([target, higher, left])
    np.testing.assert_allclose(pixel[0], [32, 24], atol=1e-9)
    assert pixel[1, 1] < 24
    assert abs(pixel[1, 0] - 32) < 1e-9
    # Facing the back of the head (+y), the patient's left (+x) is on the right.
    assert pixel[2, 0] > 32
    np.testing.assert_allclose(distance[0], math.dist(camera.eye_mm, target))


@pytest.mark.parametrize("projection", LENSES)
def test_size_changes_sampling_not_the_view(projection: Projection) -> None:
    small = posed(projection, size=(15, 15))
    large = small.with_size(45, 45)
    # Pixel centres of the small picture are those of every third pixel of the large.
    seen = np.linalg.norm(small.rays()[1], axis=-1) > 0.5
    seen &= np.linalg.norm(large.rays()[1][1::3, 1::3], axis=-1) > 0.5
    np.testing.assert_allclose(
        large.rays()[1][1::3, 1::3][seen], small.rays()[1][seen], atol=3e-7
    )
    assert seen.sum() > 100


@pytest.mark.parametrize(
    "projection",
    [Projection.EQUIDISTANT, Projection.ORTHOGRAPHIC, Projection.PERSPECTIVE],
)
def test_one_pixel_at_the_centre_subtends_radians_per_pixel(
    projection: Projection,
) -> None:
    camera = posed(projection, size=(400, 400))
    origins, directions = camera.rays()
    if projection is Projection.ORTHOGRAPHIC:
        size = math.dist(origins[200, 200], origins[200, 199])
    else:
        size = math.asin(
            float(np.linalg.norm(np.cross(directions[200, 200], directions[200, 199])))
        )
    assert size == pytest.approx(camera.radians_per_pixel, rel=1e-4)


def test_pinhole_sees_nothing_behind_itself() -> None:
    camera = posed(Projection.PERSPECTIVE)
    behind = camera.frame[0] - 5 * camera.frame[3] + 0.3 * camera.frame[1]
    pixel, _ = camera.project(behind)
    assert np.all(np.isnan(pixel))


@given(angle=st.floats(0, 2 * math.pi), distance=st.floats(0.1, 100))
def test_equidistant_puts_what_is_behind_outside_the_stop(
    angle: float, distance: float
) -> None:
    camera = posed(Projection.EQUIDISTANT)
    sideways = math.cos(angle) * camera.frame[1] + math.sin(angle) * camera.frame[2]
    behind = camera.frame[0] + distance * (0.01 * sideways - camera.frame[3])
    pixel, _ = camera.project(behind)
    radius = math.dist(pixel, (camera.width / 2, camera.height / 2))
    expected = (math.pi - math.atan(0.01)) / camera.radians_per_pixel
    assert radius == pytest.approx(expected, rel=1e-9)


def test_the_lens_table_is_shared_and_read_only() -> None:
    camera = posed(Projection.EQUIDISTANT)
    assert camera.lens_table() is posed(Projection.EQUIDISTANT, seed=9).lens_table()
    assert not camera.lens_table().flags.writeable
    assert not camera.frame.flags.writeable


AT_ORIGIN = np.vstack([np.zeros(3), np.eye(3)])


@pytest.mark.parametrize("projection", LENSES)
@pytest.mark.parametrize(
    ("frame", "extent", "size"),
    [
        (np.ones((4, 3)), 0.7, (4, 4)),
        (np.eye(4), 0.7, (4, 4)),
        *(
            (np.vstack([np.zeros(3), k * np.eye(3)]), 0.7, (4, 4))
            for k in (1e-200, 7.0)
        ),
        (np.vstack([[np.nan, 0, 0], np.eye(3)]), 0.7, (4, 4)),
        *((AT_ORIGIN, e, (4, 4)) for e in (0.0, -0.1, 2.0, math.nan, math.inf)),
        *((AT_ORIGIN, 0.7, size) for size in ((0, 4), (4, 0), (-1, 4))),
    ],
)
def test_bad_cameras_are_refused(
    projection: Projection,
    frame: NDArray[np.float64],
    extent: float,
    size: tuple[int, int],
) -> None:
    with pytest.raises(ValueError, match=r"camera|picture size"):
        Camera(frame, extent, *size, projection)


COEFFICIENTS = st.tuples(st.floats(-0.3, 0.5), st.floats(-0.1, 0.3))


def distorted(projection: Projection, k: tuple[float, float], seed: int) -> Camera:
    """Take as wide a field as the lens has before it folds, at most 1.2 rad."""
    distortion = Distortion(*k)
    fold = distortion.fold
    fold = math.atan(fold) if projection is Projection.PERSPECTIVE else fold
    return dataclasses.replace(
        posed(projection, seed, (31, 22), min(0.9 * fold, 1.2)), distortion=distortion
    )


@pytest.mark.parametrize("projection", LENSES)
@given(k=COEFFICIENTS, seed=st.integers(0, 10**6), distance=st.floats(0.1, 500))
def test_a_distorted_ray_projects_to_its_pixel(
    projection: Projection, k: tuple[float, float], seed: int, distance: float
) -> None:
    camera = distorted(projection, k, seed)
    origins, directions = camera.rays()
    seen = np.linalg.norm(directions, axis=-1) > 0.5
    assert seen[camera.height // 2, camera.width // 2]
    pixel, along = camera.project(origins + distance * directions)
    # where the lens hardly spreads any more a pixel holds no digits of an angle
    near = camera.distortion.fold * 0.97
    u = np.arccos(np.clip(directions @ camera.frame[3], -1, 1))
    u = np.tan(u) if projection is Projection.PERSPECTIVE else u
    seen &= u < near
    np.testing.assert_allclose(
        pixel[seen], pixel_centers(camera)[seen], atol=5e-4, rtol=0
    )
    np.testing.assert_allclose(along[seen], distance, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("projection", LENSES)
def test_no_distortion_changes_no_bit(projection: Projection) -> None:
    plain = posed(projection)
    none = dataclasses.replace(plain, distortion=Distortion(0.0, 0.0))
    assert none.lens_table().tobytes() == plain.lens_table().tobytes()
    points = plain.rays()[1] * 7 + plain.eye_mm
    assert np.array_equal(none.project(points)[0], plain.project(points)[0])
    # and next to none is next to nothing
    hardly = dataclasses.replace(plain, distortion=Distortion(1e-9))
    np.testing.assert_allclose(hardly.lens_table(), plain.lens_table(), atol=1e-6)


def test_a_barrel_draws_a_rod_where_its_polynomial_says() -> None:
    """A straight rod becomes the analytic curve, within .05 pixels."""
    k = (-0.25, 0.05)
    lens = Distortion(*k)
    camera = dataclasses.replace(
        posed(Projection.PERSPECTIVE, 2, (400, 400), 0.7), distortion=lens
    )
    _, right, up, forward = camera.frame
    across = np.linspace(-0.7, 0.7, 41)
    rod = camera.eye_mm + 30 * (forward + across[:, None] * right + 0.4 * up)
    pixel, _ = camera.project(rod)
    r = np.hypot(across, 0.4)
    bent = 1 + k[0] * r**2 + k[1] * r**4
    edge = math.tan(0.7)
    scale = 200 / (edge * (1 + k[0] * edge**2 + k[1] * edge**4))
    np.testing.assert_allclose(pixel[:, 0], 200 + scale * bent * across, atol=0.05)
    np.testing.assert_allclose(pixel[:, 1], 200 - scale * bent * 0.4, atol=0.05)
    # a barrel bends it outwards in the middle
    assert pixel[20, 1] < pixel[0, 1] - 5


def test_beyond_the_fold_there_is_no_ray_and_no_pixel() -> None:
    lens = Distortion(-0.3)
    # accuracy of a known lens: u = 1 / sqrt(.9), half angle 46.5 degrees
    assert lens.fold == pytest.approx(1.0541, abs=1e-4)
    camera = dataclasses.replace(
        posed(Projection.PERSPECTIVE, 5, (200, 100), 0.75), distortion=lens
    )
    directions = camera.rays()[1]
    shown = np.linalg.norm(directions, axis=-1) > 0.5
    assert shown[50, 100]
    assert not shown[50, 0]
    angle = np.arccos(np.clip(directions[shown] @ camera.frame[3], -1, 1))
    assert np.tan(angle).max() <= lens.fold + 1e-6
    beyond = camera.eye_mm + camera.frame[3] + 1.06 * camera.frame[1]
    assert np.isnan(camera.project(beyond)[0]).all()


@pytest.mark.parametrize(
    ("projection", "k", "message"),
    [
        (Projection.PERSPECTIVE, (-0.3, 0.0), r"folds at 0\.8117 rad.*got 0\.9"),
        (Projection.EQUIDISTANT, (-0.6, 0.0), r"folds at 0\.7454 rad.*got 0\.9"),
        (Projection.ORTHOGRAPHIC, (-0.1, 0.0), "no lens to be distorted"),
    ],
)
def test_a_lens_that_folds_in_its_field_is_refused(
    projection: Projection, k: tuple[float, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(posed(projection, extent=0.9), distortion=Distortion(*k))
