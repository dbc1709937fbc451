"""Turn any field with the right sign into a signed distance to its zero set."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from anatomy.kernels import sweep_distance as kernels
from system import UserError

DEEPEST_MM, FARTHEST_MM = -12.0, 6.0
"""Limits of the stored distance: in air, instruments and rays take long steps; in
tissue, only what is near the surface is asked for."""

_ROUNDS = 2
"""Rounds of eight sweeps; a third changes no value of the default head by 1e-4 mm."""


def redistance(
    field: NDArray[np.float32], spacing_mm: float, threads: int = 1
) -> NDArray[np.float32]:
    """Compute the signed distance in mm to where `field` changes sign.

    field: ``(nz, ny, nx)`` float32, negative inside. The result has exactly the
    field's sign (zero counts as outside), lies in ``[DEEPEST_MM, FARTHEST_MM]``, and
    is first order accurate away from the surface. Near the border of the grid it
    knows only the surface inside the grid. threads: more than one sweep air and
    tissue at the same time; values next to the surface part the two, so the result
    is the same.
    """
    return signed_distance(field, spacing_mm, -DEEPEST_MM, FARTHEST_MM, threads)


def signed_distance(
    field: NDArray[np.float32],
    spacing_mm: float,
    inside_mm: float,
    outside_mm: float,
    threads: int = 1,
) -> NDArray[np.float32]:
    """Compute what `redistance` does, up to limits of one's own, both positive mm."""
    values = np.ascontiguousarray(field, dtype=np.float32)
    if values.ndim != 3 or not spacing_mm > 0:
        raise UserError(
            f"redistancing needs a 3-D field and a positive spacing, got shape "
            f"{values.shape} and {spacing_mm} mm"
        )
    distance = np.empty_like(values)
    state = np.zeros(values.shape, dtype=np.uint8)
    rows = np.zeros((2, *values.shape[:2]), dtype=np.uint8)
    h, far = np.float32(spacing_mm), np.float32(inside_mm)
    kernels.start_values(values, h, far, np.float32(outside_mm), distance, state, rows)

    def sweep(space: int) -> None:
        kernels.sweep(
            distance, state, rows[space], kernels.TISSUE + space, h, far, _ROUNDS
        )

    with ThreadPoolExecutor(max_workers=min(threads, 2)) as pool:
        list(pool.map(sweep, (0, 1)))
    np.minimum(distance, np.float32(outside_mm), out=distance, where=values >= 0)
    np.negative(distance, out=distance, where=values < 0)
    return distance
