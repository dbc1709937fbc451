"""The overview's head: its triangles lie on the surface; the face is told apart."""

import numpy as np
import pytest

from anatomy.abstract import build_scene
from app.vtk.head_model import COARSENESS, FACE, FINE, MUCOSA, head_model
from renderers.scene import AirSurface, Volume

SPACING_MM = 0.5
CAVITY_MM, RADIUS_MM = np.array([10.0, 20.0, 10.0]), 5.0
FACE_Y_MM = 6.0


@pytest.fixture(scope="module")
def surface() -> AirSurface:
    """A closed round cavity behind a flat face; the front is where y is small."""
    z, y, x = np.meshgrid(*(np.arange(61) * SPACING_MM,) * 3, indexing="ij")
    at = np.stack([x, y, z], axis=-1)
    ball = np.linalg.norm(at - CAVITY_MM, axis=-1) - RADIUS_MM
    distance = np.minimum(ball, y - FACE_Y_MM).astype(np.float32)
    nothing = np.zeros(distance.shape, np.uint8)
    spacing, origin = np.full(3, SPACING_MM), np.zeros(3)
    return AirSurface(
        Volume(distance, spacing, origin),
        Volume(nothing, spacing, origin),
        Volume(nothing, spacing, origin),
    )


def test_points_lie_on_the_air_surface(surface: AirSurface) -> None:
    mesh = head_model(surface, {}).mesh
    off = np.abs(surface.distance.sample(np.asarray(mesh.points, dtype=np.float64)))
    inside = np.asarray(mesh.points).max(axis=1) < 29.0
    # Smoothing flattens a coarse ball by a part of one coarse voxel.
    assert off[inside].max() < COARSENESS * SPACING_MM / 2
    assert mesh.n_cells > 500


def test_the_face_is_tinted_otherwise_than_the_cavity(surface: AirSurface) -> None:
    mesh = head_model(surface, {}).mesh
    points, rgba = np.asarray(mesh.points), np.asarray(mesh.point_data["rgba"])
    in_cavity = points[:, 1] > (FACE_Y_MM + CAVITY_MM[1] - RADIUS_MM) / 2
    opacity = rgba[:, 3] / 255
    assert np.allclose(opacity[in_cavity], MUCOSA[3], atol=0.01)
    assert np.allclose(opacity[~in_cavity], FACE[3], atol=0.01)
    assert in_cavity.any()
    assert not in_cavity.all()


def test_landmarks_are_kept(surface: AirSurface) -> None:
    assert head_model(surface, {"ostium": CAVITY_MM}).targets == {"ostium": CAVITY_MM}


def test_the_whole_head_takes_the_place_of_the_faces_part(surface: AirSurface) -> None:
    axis = np.arange(-30.0, 61.0, 2.0)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    off = 28.0 - np.linalg.norm(np.stack([x, y, z], -1) - 15.0, axis=-1)
    head = Volume(off.astype(np.float32), np.full(3, 2.0), np.full(3, -30.0))
    whole = head_model(surface, {}, face=head)
    points, rgba = np.asarray(whole.mesh.points), whole.mesh.point_data["rgba"]
    is_skin = np.asarray(rgba)[:, 3] < 255 * (FACE[3] + 0.01)
    apart = np.linalg.norm(points - 15.0, axis=1)
    assert apart[is_skin] == pytest.approx(np.full(is_skin.sum(), 28.0), abs=1.0)
    # What is left of the air surface is the cavity: the flat face is gone.
    ball = np.linalg.norm(points[~is_skin] - CAVITY_MM, axis=1)
    assert np.median(ball) == pytest.approx(RADIUS_MM, abs=0.5)
    assert (points[~is_skin, 1] > FACE_Y_MM + 2.0).all()
    assert whole.focus_mm is not None
    middle = whole.focus_mm.mean(axis=0)
    assert middle == pytest.approx(CAVITY_MM, abs=2.0)


@pytest.mark.parametrize("with_face", [False, True])
def test_a_renewed_mesh_is_that_of_a_new_model(
    surface: AirSurface, with_face: bool
) -> None:
    """Of the surface as it is then, cut in place; the skin stays what it was."""
    values = surface.distance.values.copy()
    distance = surface.distance.with_values(values, surface.distance.background)
    living = AirSurface(distance, surface.blood, surface.skin)
    axis = np.arange(-30.0, 61.0, 2.0)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    off = 28.0 - np.linalg.norm(np.stack([x, y, z], -1) - 15.0, axis=-1)
    whole = Volume(off.astype(np.float32), np.full(3, 2.0), np.full(3, -30.0))
    face = whole if with_face else None
    model = head_model(living, {}, face=face)
    before = np.array(model.mesh.points)
    z, y, x = np.meshgrid(*(np.arange(61) * SPACING_MM,) * 3, indexing="ij")
    at = np.stack([x, y, z], axis=-1)
    ball = np.linalg.norm(at - CAVITY_MM - [6.0, 0, 0], axis=-1) - 4.0
    np.minimum(values, ball.astype(np.float32), out=values)
    assert model.renew is not None
    renewed, fresh = model.renew(), head_model(living, {}, face=face).mesh
    assert np.array_equal(renewed.points, fresh.points)
    assert np.array_equal(renewed.faces, fresh.faces)
    assert np.array_equal(renewed.point_data["rgba"], fresh.point_data["rgba"])
    assert renewed.n_points != len(before)
    assert np.array_equal(model.mesh.points, before)


def test_a_fine_model_keeps_a_thin_ring_whole() -> None:
    space = build_scene("hoops", 2)
    surface = AirSurface(space.distance, space.blood, space.skin)
    mesh = head_model(surface, {}, coarseness=FINE).mesh
    # the room with its mouth, and six rings
    assert mesh.connectivity()["RegionId"].max() + 1 == 7
