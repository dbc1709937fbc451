"""A mesh's depth against the closed forms of a plane and a sphere."""

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from renderers.scene import Camera, Distortion, Material, Mesh, Projection
from renderers.scene.kernels.triangles import NEAREST_MM

ALL = list(Projection)
SEEDS = st.integers(0, 10**6)


def camera_of(projection: Projection, size: int = 48) -> Camera:
    extent = 12.0 if projection is Projection.ORTHOGRAPHIC else 0.6
    return Camera.looking_at(
        (3, -40, 7), (1, 2, 5), extent=extent, size=(size, size), projection=projection
    )


# Cutting a large mesh up takes longer than drawing it, so that equal ones are one.


@cache
def sphere(radius: float, subdivisions: int) -> Mesh:
    solid = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return Mesh(np.asarray(solid.vertices), np.asarray(solid.faces, dtype=np.int32))


@cache
def plate(half: float) -> Mesh:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * half
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))


def placed(center: NDArray[np.float64], seed: int = 0) -> NDArray[np.float64]:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    matrix[:3, 3] = center
    return matrix


def sphere_depth(
    camera: Camera, center: NDArray[np.float64], radius: float
) -> NDArray[np.float64]:
    """Solve |o + t d - c| = r for the nearer t >= 0; infinite where there is none."""
    origins, directions = camera.rays()
    to_center = center - origins
    along = np.sum(to_center * directions, axis=-1)
    square = along**2 - np.sum(to_center**2, axis=-1) + radius**2
    seen = (square > 0) & (np.linalg.norm(directions, axis=-1) > 0.5) & (along > 0)
    return np.where(seen, along - np.sqrt(np.maximum(square, 0)), np.inf)


@pytest.mark.parametrize("projection", ALL)
@given(seed=SEEDS)
def test_a_plate_larger_than_the_view_is_the_plane(
    projection: Projection, seed: int
) -> None:
    camera = camera_of(projection)
    rng = np.random.default_rng(seed)
    center = camera.eye_mm + rng.uniform(10, 60) * camera.frame[3]
    tilt = Rotation.from_rotvec(rng.uniform(-0.25, 0.25, 3)).as_matrix()
    pose = np.eye(4)
    pose[:3, :3] = tilt @ camera.frame[1:].T
    pose[:3, 3] = center
    normal = pose[:3, 2]
    found = plate(400).gbuffer(camera, pose)
    origins, directions = camera.rays()
    with np.errstate(divide="ignore", invalid="ignore"):
        expected = ((center - origins) @ normal) / (directions @ normal)
    seen = np.linalg.norm(directions, axis=-1) > 0.5
    assert np.array_equal(np.isfinite(found.depth_mm), seen)
    # float32 rays against an 800 mm plate
    np.testing.assert_allclose(found.depth_mm[seen], expected[seen], rtol=2e-5)
    towards_eye = -np.sign(camera.frame[3] @ normal) * normal
    np.testing.assert_allclose(
        found.normal[seen], np.broadcast_to(towards_eye, (seen.sum(), 3)), atol=1e-5
    )
    assert np.all(found.coverage == seen)


@pytest.mark.parametrize("projection", ALL)
@given(seed=SEEDS)
def test_a_sphere_lies_between_its_inner_and_outer_radius(
    projection: Projection, seed: int
) -> None:
    camera = camera_of(projection)
    rng = np.random.default_rng(seed)
    center = (
        camera.eye_mm
        + rng.uniform(25, 50) * camera.frame[3]
        + rng.uniform(-9, 9, 2) @ camera.frame[1:3]
    )
    radius = 6.0
    mesh = sphere(radius, 3)
    corners = mesh.vertices[mesh.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    inner = float(np.abs(np.sum(across * corners[:, 0], axis=1)).min())
    found = mesh.gbuffer(camera, placed(center, seed)).depth_mm
    nearest = sphere_depth(camera, center, radius)
    farthest = sphere_depth(camera, center, inner)
    assert np.all(found >= nearest - 1e-4)
    assert np.all(found <= farthest + 1e-4)
    assert np.isfinite(farthest).sum() > 20


def test_finer_spheres_converge_at_second_order() -> None:
    camera = camera_of(Projection.EQUIDISTANT)
    center = camera.eye_mm + 30 * camera.frame[3]
    exact = sphere_depth(camera, center, 8.0)
    inner = np.isfinite(sphere_depth(camera, center, 6.0))
    errors = []
    for level in (2, 3, 4):
        found = sphere(8.0, level).gbuffer(camera, placed(center)).depth_mm
        errors.append(float(np.mean(np.abs(found[inner] - exact[inner]))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2, atol=0.15)


@pytest.mark.parametrize("projection", ALL)
@settings(max_examples=8)
@given(seed=SEEDS)
def test_moving_mesh_and_camera_together_keeps_the_depth(
    projection: Projection, seed: int
) -> None:
    camera, mesh = camera_of(projection), sphere(7.0, 2)
    pose = placed(camera.eye_mm + 30 * camera.frame[3], 3)
    motion = placed(np.random.default_rng(seed).uniform(-80, 80, 3), seed)
    frame = camera.frame @ motion[:3, :3].T
    frame[0] += motion[:3, 3]
    moved = Camera(frame, camera.extent, camera.width, camera.height, projection)
    before = mesh.gbuffer(camera, pose)
    after = mesh.gbuffer(moved, motion @ pose)
    same = np.isfinite(before.depth_mm) & np.isfinite(after.depth_mm)
    # A silhouette pixel may fall on either side by rounding.
    assert (np.isfinite(before.depth_mm) ^ np.isfinite(after.depth_mm)).sum() <= 3
    change = np.abs(before.depth_mm[same] - after.depth_mm[same])
    # Likewise a pixel on an edge may move to the neighbouring facet, but not away.
    assert np.median(change) < 1e-5
    assert change.max() < 1e-2
    turned = before.normal[same] @ motion[:3, :3].T
    assert np.median(np.abs(turned - after.normal[same])) < 1e-5


@pytest.mark.parametrize("projection", ALL)
def test_normals_are_unit_face_the_eye_and_cover_is_where_depth_is(
    projection: Projection,
) -> None:
    camera = camera_of(projection)
    center = camera.eye_mm + 30 * camera.frame[3] + 5 * camera.frame[1]
    mesh = sphere(7.0, 3)
    for flipped in (mesh, Mesh(mesh.vertices, mesh.faces[:, ::-1])):
        buffer = flipped.gbuffer(camera, placed(center))
        hit = np.isfinite(buffer.depth_mm)
        assert 50 < hit.sum() < hit.size
        assert np.array_equal(buffer.coverage, hit)
        assert np.array_equal(buffer.material, hit * np.uint8(Material.METAL))
        origins, directions = camera.rays()
        normal = buffer.normal[hit].astype(np.float64)
        np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-6)
        assert np.all(np.sum(normal * directions[hit], axis=1) < 0)
        assert not buffer.normal[~hit].any()
        point = origins[hit] + buffer.depth_mm[hit, None] * directions[hit]
        outwards = (point - center) / np.linalg.norm(point - center, axis=1)[:, None]
        assert np.sum(normal * outwards, axis=1).min() > 0.99


DISTORTED = [
    (Projection.PERSPECTIVE, Distortion(-0.3, 0.05)),
    (Projection.PERSPECTIVE, Distortion(0.5)),
    (Projection.EQUIDISTANT, Distortion(-0.4)),
    (Projection.EQUIDISTANT, Distortion(0.3, -0.1)),
]


@pytest.mark.parametrize(("projection", "distortion"), DISTORTED)
@given(seed=SEEDS)
def test_a_distorted_lens_meets_a_sphere_with_its_own_rays(
    projection: Projection, distortion: Distortion, seed: int
) -> None:
    """The closed form of every ray; no triangle is looked for in the wrong place."""
    camera = dataclasses.replace(camera_of(projection), distortion=distortion)
    rng = np.random.default_rng(seed)
    center = (
        camera.eye_mm
        + rng.uniform(6, 40) * camera.frame[3]
        + rng.uniform(-14, 14, 2) @ camera.frame[1:3]
    )
    radius = rng.uniform(0.5, 4.0)
    found = sphere(radius, 3).gbuffer(camera, placed(center, seed)).depth_mm
    outer = sphere_depth(camera, center, radius)
    # an icosphere of three subdivisions lies within this of its ball
    inner = sphere_depth(camera, center, 0.993 * radius)
    surely = np.isfinite(inner)
    assert np.isfinite(found[surely]).all()
    assert np.all(found[surely] <= inner[surely] + 1e-4)
    hit = np.isfinite(found)
    assert np.all(np.isfinite(outer[hit]))
    assert np.all(found[hit] >= outer[hit] - 1e-4)


def test_the_eye_inside_a_solid_sees_nothing_of_it_and_a_room_all_around() -> None:
    camera = Camera(np.vstack([[0, 0, 0], np.eye(3)]), math.radians(88), 40, 40)
    solid = sphere(10.0, 4)
    assert not solid.gbuffer(camera, np.eye(4)).coverage.any()
    room = Mesh(solid.vertices, solid.faces[:, ::-1])
    found = room.gbuffer(camera, np.eye(4)).depth_mm
    seen = np.linalg.norm(camera.rays()[1], axis=-1) > 0.5
    assert np.all((found[seen] > 9.97) & (found[seen] < 10.0001))


def test_nothing_that_all_but_touches_the_lens_is_drawn() -> None:
    camera = camera_of(Projection.EQUIDISTANT)
    pose = np.eye(4)
    pose[:3, :3] = camera.frame[1:].T
    for away_mm, is_seen in ((0.9 * NEAREST_MM, False), (1.1 * NEAREST_MM, True)):
        pose[:3, 3] = camera.eye_mm + away_mm * camera.frame[3]
        assert np.any(plate(0.1).gbuffer(camera, pose).coverage) == is_seen


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((0, 3)), [[0, 0, 0]], "vertices"),
        (np.zeros((3, 2)), [[0, 1, 2]], "vertices"),
        (np.full((3, 3), np.nan), [[0, 1, 2]], "finite"),
        (np.zeros((3, 3)), np.zeros((0, 3)), "faces"),
        (np.zeros((3, 3)), [[0, 1]], "faces"),
        (np.zeros((3, 3)), [[0, 1, 3]], "vertex 3"),
        (np.zeros((3, 3)), [[0, 1, -1]], "vert"),
    ],
)
def test_bad_meshes_are_refused(
    vertices: NDArray[np.float64], faces: list[list[int]], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        Mesh(vertices, np.array(faces, dtype=np.int32))


def test_round_parts_are_smooth_and_edges_are_sharp() -> None:
    """A coarse cylinder's side has a round surface's normals, its end a flat one."""
    import trimesh

    body = trimesh.creation.cylinder(radius=3.0, height=20.0, sections=24)
    mesh = Mesh(np.asarray(body.vertices), np.asarray(body.faces, dtype=np.int32))
    camera = Camera.looking_at(
        (0.0, -14.0, 14.0), (0.0, 0.0, 10.0), extent=0.4, size=(128, 128)
    )
    buffer = mesh.gbuffer(camera, np.eye(4))
    hit = np.isfinite(buffer.depth_mm)
    origins, directions = camera.rays()
    point = origins[hit] + buffer.depth_mm[hit, None] * directions[hit]
    normal = buffer.normal[hit]
    end = (point[:, 2] > 10 - 1e-3) & (np.hypot(point[:, 0], point[:, 1]) < 2.9)
    assert end.sum() > 100
    np.testing.assert_allclose(
        normal[end], np.tile([0, 0, 1], (end.sum(), 1)), atol=1e-5
    )
    side = point[:, 2] < 9
    outwards = point[side] * [1, 1, 0]
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    angle = np.degrees(np.arccos(np.clip((normal[side] * outwards).sum(1), -1, 1)))
    # flat facets of 15 degrees would be off by up to 7.5
    assert np.percentile(angle, 95) < 1.0
