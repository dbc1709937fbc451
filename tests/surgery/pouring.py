"""Blood laid on walls by hand, as no session does."""

import numpy as np
from numpy.typing import ArrayLike

from surgery import film as blood
from surgery.film import BleedingRate, BloodFilm
from surgery.kernels.film_cells import cell_of, nearest_cell


def pour(film: BloodFilm, point_mm: ArrayLike, volume_mm3: float) -> None:
    """Lay blood on the cell next to a place, as if mucosa had bled it."""
    film._make_room()
    row = cell_of(film._ground, film._cells, _nearest(film, point_mm))
    units = round(volume_mm3 / blood.UNIT_MM3)
    film._cells.volume[row] += units
    film.books.bled[blood.MUCOSA] += units


def bleed_from(film: BloodFilm, point_mm: ArrayLike, rate: BleedingRate) -> None:
    """Open an artery of ``rate.rate`` mL/min at the cell next to a place."""
    rates = np.array([[rate.rate * 1000 / 60 / blood.UNIT_MM3, rate.tau_s]])
    voxel = np.array([_nearest(film, point_mm)], np.int32)
    kind = np.array([blood.ARTERY], np.int8)
    film._sources.add(voxel, kind, film._step or 0, rates)


def _nearest(film: BloodFilm, point_mm: ArrayLike) -> int:
    matrix = film._volume.voxel_from_world
    point = np.asarray(point_mm, np.float64)
    i, j, k = np.rint(matrix[:3, :3] @ point + matrix[:3, 3]).astype(int)
    voxel = int(nearest_cell(film._ground.distance, i, j, k, 6))
    assert voxel >= 0, "no surface is near"
    return voxel
