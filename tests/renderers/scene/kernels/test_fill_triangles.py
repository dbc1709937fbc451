"""Eight rays at a time meet what each meets alone."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from scipy.spatial.transform import Rotation

from renderers.scene import Camera, GBuffer, Projection
from renderers.scene.facets import Facets
from renderers.scene.kernels.fill_triangles import fill_facets as packets
from renderers.scene.mesh import run_at_once
from renderers.scene.mesh_drawing import list_facets_in_view
from tests.renderers.scene.plain_triangles import fill_facets as plain
from tests.slow_cases import slow

HIGH = 24
"""Rows of a picture that is drawn ray by ray as well."""


@pytest.fixture(scope="module")
def ring() -> Facets:
    solid = trimesh.creation.torus(major_radius=6, minor_radius=1)
    return Facets.of(np.asarray(solid.vertices)[solid.faces])


@pytest.mark.parametrize(
    "projection",
    [Projection.EQUIDISTANT, *slow(Projection.PERSPECTIVE, Projection.ORTHOGRAPHIC)],
)
@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), width=st.integers(3, 90))
def test_the_bits_are_the_same(
    ring: Facets, projection: Projection, seed: int, width: int
) -> None:
    random = np.random.default_rng(seed)
    extent = 15.0 if projection is Projection.ORTHOGRAPHIC else 0.9
    camera = Camera.looking_at(
        (0, 0, 0), (0, 1, 0), extent=extent, size=(width, HIGH), projection=projection
    )
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    # around the eye, or from nearly touching it to far
    pose[:3, 3] = (*random.uniform(-6, 6, 2), random.uniform(-5, 30))
    pose[:3, 3] = camera.frame[1:].T @ pose[:3, 3]
    wall = random.uniform(1, 40, (HIGH, width)).astype(np.float32)
    drawn = []
    for fill in (packets, plain):
        buffer = GBuffer.empty(HIGH, width)
        buffer.depth_mm[:] = wall
        list_facets_in_view(ring, 1, camera, pose).draw(buffer, run_at_once, fill)
        drawn.append(buffer)
    a, b = drawn
    assert_array_equal(a.depth_mm, b.depth_mm)
    assert_array_equal(a.normal, b.normal)
    assert_array_equal(a.material, b.material)


def test_a_ring_ahead_is_drawn(ring: Facets) -> None:
    camera = Camera.looking_at((0, 0, 0), (0, 1, 0), extent=0.9, size=(90, 67))
    pose = np.eye(4)
    pose[1, 3] = 20
    buffer = GBuffer.empty(67, 90)
    list_facets_in_view(ring, 1, camera, pose).draw(buffer, run_at_once, packets)
    assert np.count_nonzero(buffer.material) > 100
    pose[1, 3] = -20
    behind = GBuffer.empty(67, 90)
    list_facets_in_view(ring, 1, camera, pose).draw(behind, run_at_once, packets)
    assert not np.any(behind.material)
