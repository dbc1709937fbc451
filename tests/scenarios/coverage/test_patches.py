"""Patches of a surface: their area, their facing, what is open."""

import math

import numpy as np
import pytest

from scenarios.coverage import mucosa_of
from tests.scenarios.coverage.rooms import sphere_room, walled_room


@pytest.mark.parametrize(("radius_mm", "spacing_mm"), [(6.0, 0.4), (10.0, 0.5)])
def test_areas_sum_to_that_of_a_ball(radius_mm: float, spacing_mm: float) -> None:
    mucosa = mucosa_of(sphere_room(radius_mm, spacing_mm))
    assert mucosa.area_mm2.sum() == pytest.approx(4 * math.pi * radius_mm**2, rel=0.02)
    away = np.linalg.norm(mucosa.places, axis=1)
    assert np.abs(away - radius_mm).max() < 0.2
    towards = (mucosa.normals * mucosa.places).sum(axis=1) / away
    assert towards.max() < -0.9


def test_both_sides_of_a_thin_wall_are_patches_of_their_own() -> None:
    mucosa = mucosa_of(walled_room())
    on_wall = (np.abs(mucosa.places[:, 1] - 5.3) < 1.3) & (mucosa.places[:, 0] < 4.0)
    on_wall &= np.linalg.norm(mucosa.places, axis=1) < 8.0
    assert (mucosa.normals[on_wall, 1] > 0.9).any()
    assert (mucosa.normals[on_wall, 1] < -0.9).any()


def test_what_is_closed_does_not_count() -> None:
    room = sphere_room(8.0)
    values = room.values.copy()
    grid = 0.5 * (np.arange(values.shape[0]) - (values.shape[0] - 1) / 2)
    z, y, x = np.meshgrid(grid, grid, grid, indexing="ij")
    cell = np.sqrt((x - 9.2) ** 2 + (y - 9.2) ** 2 + (z - 9.2) ** 2) - 1.2
    closed = room.with_values(np.minimum(values, cell).astype(np.float32), 10.0)
    assert mucosa_of(closed).area_mm2.sum() == pytest.approx(
        mucosa_of(room).area_mm2.sum(), rel=1e-3
    )


def test_places_that_are_checked_lie_on_the_surface_and_know_their_patch() -> None:
    room = sphere_room()
    mucosa = mucosa_of(room)
    assert len(mucosa.checked) > 1900
    assert np.abs(room.sample(mucosa.checked)).max() < 0.1
    apart = mucosa.places[mucosa.checked_patch] - mucosa.checked
    assert np.linalg.norm(apart, axis=1).max() < 2.0
    # drawn evenly: as many above as below, within four standard deviations
    above = (mucosa.checked[:, 2] > 0).mean()
    assert abs(above - 0.5) < 4 * 0.5 / math.sqrt(len(mucosa.checked))
