"""Triangles at a density, before a ball whose surface is known."""

import numpy as np
import pytest

pytest.importorskip("pyvista", reason="the extra 'desktop'", exc_type=ImportError)

from app.vtk.volume_surface import contour
from renderers.scene import Volume

MIDDLE_MM, RADIUS_MM, SPACING_MM = np.array([9.13, 11.21, 10.07]), 7.0, 0.5


def ball() -> Volume:
    """Densities that fall by one a millimetre, 0 on the ball's surface."""
    side = np.arange(45) * SPACING_MM
    z, y, x = np.meshgrid(side, side, side, indexing="ij")
    away = np.linalg.norm(np.stack([x, y, z], axis=-1) - MIDDLE_MM, axis=-1)
    return Volume(
        (RADIUS_MM - away).astype(np.float32), np.full(3, SPACING_MM), np.zeros(3)
    )


@pytest.mark.parametrize(("most", "step"), [(10**6, 1), (15_000, 2), (5_000, 3)])
def test_coarse_or_fine_it_lies_on_the_ball_and_faces_outwards(
    most: int, step: int
) -> None:
    mesh = contour(ball(), 0.0, most)
    way = np.asarray(mesh.points) - MIDDLE_MM
    away = np.linalg.norm(way, axis=1)
    # a chord of one edge lies so far within the ball
    edge_mm = step * SPACING_MM * np.sqrt(3.0)
    assert np.abs(away - RADIUS_MM).max() < edge_mm**2 / (8.0 * RADIUS_MM) + 1e-3
    normals = np.asarray(mesh.point_data["Normals"])
    along = np.sum(normals * way, axis=1) / away
    # all one way round, though nothing makes them agree
    assert len(set(np.sign(along))) == 1
    assert np.abs(along).min() > 0.9
    expected = 4.0 * np.pi * RADIUS_MM**2
    assert mesh.area == pytest.approx(expected, rel=0.03)
