"""Triangles along a lens's rays: against a ray library, and inside their bounds."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from renderers.scene import Camera, GBuffer, Material, Mesh, Projection
from renderers.scene.facets import Facets
from renderers.scene.kernels.triangles import NEAREST_MM
from renderers.scene.mesh import run_at_once
from renderers.scene.mesh_drawing import list_facets_in_view

SEEDS = st.integers(0, 2**32 - 1)


def holds(solid: Any, place: NDArray[np.float64]) -> bool:
    """Whether a place is within any part of a solid."""
    return any(part.contains(place[None])[0] for part in solid.split())


def knot() -> Any:
    """Long, thin, curved and sharp parts in one solid."""
    rod = trimesh.creation.cylinder(radius=1.2, height=60, sections=20)
    ring = trimesh.creation.torus(major_radius=6, minor_radius=1)
    ring.apply_translation([0, 0, 20])
    box = trimesh.creation.box(extents=(4, 0.5, 9))
    parts: list[Any] = [rod, ring, box]
    return trimesh.util.concatenate(parts)


def embree_depth(
    mesh: Mesh, camera: Camera, pose: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give depth, infinite for a miss, and |cosine| between ray and triangle."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene()
    corners = mesh.vertices[mesh.faces] @ pose[:3, :3].T + pose[:3, 3]
    TriangleMesh(scene, np.ascontiguousarray(corners - camera.frame[0], np.float32))
    origins, directions = camera.rays()
    seen = np.linalg.norm(directions, axis=-1) > 0.5
    hit = scene.run(
        (origins[seen] - camera.frame[0]).astype(np.float32),
        directions[seen].astype(np.float32),
        output=True,
    )
    depth = np.full(seen.shape, np.inf)
    cosine = np.zeros(seen.shape)
    depth[seen] = np.where(hit["geomID"] != -1, hit["tfar"], np.inf)
    normal = hit["Ng"] / np.maximum(np.linalg.norm(hit["Ng"], axis=1), 1e-30)[:, None]
    cosine[seen] = np.abs(np.sum(normal * directions[seen], axis=1))
    return depth, cosine


@pytest.mark.parametrize(
    "projection",
    [
        p if p == Projection.EQUIDISTANT else pytest.param(p, marks=pytest.mark.slow)
        for p in Projection
    ],
)
@settings(max_examples=15)
@given(seed=SEEDS)
def test_a_ray_library_finds_the_same_depths(projection: Projection, seed: int) -> None:
    rng = np.random.default_rng(seed)
    solid = knot()
    mesh = Mesh(np.asarray(solid.vertices), np.asarray(solid.faces, dtype=np.int32))
    extent = 15.0 if projection is Projection.ORTHOGRAPHIC else 0.7
    camera = Camera.looking_at(
        rng.uniform(-5, 5, 3), rng.uniform(-5, 5, 3) + 30 * np.eye(3)[1], extent=extent,
        size=(int(rng.integers(3, 100)), 80), projection=projection,
    )  # fmt: skip
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    # from nearly touching the eye to far, also beside and behind it
    pose[:3, 3] = camera.eye_mm + camera.frame[3] * rng.uniform(-5, 50)
    pose[:3, 3] += rng.uniform(-8, 8, 3)
    if projection is not Projection.ORTHOGRAPHIC:
        assume(not holds(solid, (camera.eye_mm - pose[:3, 3]) @ pose[:3, :3]))
        assume(not mesh.spine(pose).holds(camera.eye_mm))
    found = mesh.gbuffer(camera, pose).depth_mm.astype(np.float64)
    expected, cosine = embree_depth(mesh, camera, pose)
    if projection is not Projection.ORTHOGRAPHIC:
        found[expected < NEAREST_MM] = expected[expected < NEAREST_MM] = np.inf
    # At an edge a ray may be rounded to either side of it.
    differ = np.isfinite(found) != np.isfinite(expected)
    assert differ.sum() <= 4
    both = np.isfinite(found) & np.isfinite(expected)
    error = np.abs(found[both] - expected[both]) * cosine[both]
    assert np.count_nonzero(error > 2e-4) <= 4


def test_drawing_into_a_picture_keeps_what_is_nearer() -> None:
    camera = Camera.looking_at((0, -20, 0), (0, 0, 0), extent=0.5, size=(64, 64))
    solid = trimesh.creation.icosphere(subdivisions=3, radius=4.0)
    mesh = Mesh(np.asarray(solid.vertices), np.asarray(solid.faces, dtype=np.int32))
    alone = mesh.gbuffer(camera, np.eye(4))
    wall = GBuffer.empty(64, 64)
    wall.depth_mm[:, :32] = 5
    wall.depth_mm[:, 32:] = 40
    wall.coverage[:] = 0.5
    wall.normal[..., 2] = 1
    before = wall.depth_mm.copy()
    mesh.draw(wall, camera, np.eye(4))
    drawn = np.isfinite(alone.depth_mm) & (np.arange(64) >= 32)
    assert drawn.sum() > 100
    assert np.array_equal(wall.depth_mm[drawn], alone.depth_mm[drawn])
    assert np.array_equal(wall.depth_mm[~drawn], before[~drawn])
    assert np.array_equal(wall.normal[drawn], alone.normal[drawn])
    assert np.all(wall.normal[~drawn] == [0, 0, 1])
    assert np.array_equal(wall.coverage, np.where(drawn, 1, np.float32(0.5)))
    assert np.array_equal(wall.material, drawn * np.uint8(Material.METAL))


@given(seed=SEEDS)
@settings(max_examples=15)
def test_rows_may_be_dealt_out_in_any_way(seed: int) -> None:
    rng = np.random.default_rng(seed)
    solid = knot()
    mesh = Mesh(np.asarray(solid.vertices), np.asarray(solid.faces, dtype=np.int32))
    camera = Camera.looking_at((0, -20, 0), (0, 0, 0), extent=0.6, size=(50, 61))
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=seed).as_matrix()

    def bands(rows: int, kernel: Callable[[int, int], None]) -> None:
        # no more than the rows that the mesh may be in
        assert 10 < rows <= 61
        cuts = [0, *sorted(rng.integers(0, rows + 1, 4)), rows]
        for first, last in itertools.pairwise(cuts):
            kernel(first, last)

    whole = mesh.gbuffer(camera, pose)
    cut = GBuffer.empty(61, 50)
    mesh.draw(cut, camera, pose, bands)
    for name in ("depth_mm", "normal", "coverage", "material"):
        assert np.array_equal(getattr(whole, name), getattr(cut, name))


@pytest.mark.parametrize(
    "projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE], ids=str
)
@settings(max_examples=25)
@given(seed=SEEDS)
@example(seed=418431)  # 0.17 mm beside the rod, whose front is too near to be drawn
def test_backs_of_solids_are_hidden_from_outside(
    projection: Projection, seed: int
) -> None:
    solid = knot()
    all_sides = Facets.of(np.asarray(solid.vertices)[solid.faces])
    assert all_sides.is_closed
    with_backs = replace(all_sides, is_closed=False)
    rng = np.random.default_rng(seed)
    camera = Camera.looking_at(
        (0, 0, 0), (0, 1, 0), extent=0.9, size=(70, 61), projection=projection
    )
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    pose[:3, 3] = rng.uniform(-12, 12, 3)
    pose[1, 3] += 12
    assume(not holds(solid, -pose[:3, 3] @ pose[:3, :3]))

    def drawn(facets: Facets, pose: NDArray[np.float64]) -> GBuffer:
        buffer = GBuffer.empty(61, 70)
        list_facets_in_view(facets, 1, camera, pose).draw(buffer, run_at_once)
        return buffer

    fronts, both = drawn(all_sides, pose), drawn(with_backs, pose)
    # What nothing hides, since it is too near to be drawn: a tool so much larger has
    # the same bits but for the exponents, and is all beyond NEAREST_MM.
    large = np.float32(1024.0)
    grown = replace(
        all_sides,
        corners=all_sides.corners * large,
        pieces=all_sides.pieces * large,
        spheres=all_sides.spheres * large,
    )
    away = pose.copy()
    away[:3, 3] *= large
    nearest_mm = drawn(grown, away).depth_mm / large
    far = nearest_mm > NEAREST_MM
    assert np.array_equal(fronts.depth_mm[far], nearest_mm[far])
    assert np.array_equal(fronts.material[far], both.material[far])
    # at a silhouette a front and a back meet at one depth, which is rounded
    differ = far & (fronts.depth_mm != both.depth_mm)
    assert differ.sum() <= 2
    same = far & ~differ
    assert np.array_equal(fronts.normal[same], both.normal[same])


def test_only_what_bounds_a_solid_is_closed() -> None:
    solid = trimesh.creation.icosphere(subdivisions=1)
    corners = np.asarray(solid.vertices)[solid.faces]
    assert Facets.of(corners).is_closed
    assert not Facets.of(corners[1:]).is_closed
    assert not Facets.of(corners[:, ::-1]).is_closed
    one_turned = corners.copy()
    one_turned[0] = one_turned[0, ::-1]
    assert not Facets.of(one_turned).is_closed
    twice = np.concatenate([corners, corners])
    assert not Facets.of(twice).is_closed
