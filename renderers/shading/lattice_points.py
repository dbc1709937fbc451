"""Points of a lattice of pixels, and which of them a part of a picture asks for.

Point (j, i) of a lattice of some stride is the pixel ``(j * stride, i * stride)``, or
the last one of its row or column where that lies beyond the picture.
"""

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


def asked_points(only: Mask | None, size: tuple[int, int], stride: int) -> Mask:
    """Mark the corners ``(h // stride + 2, w // stride + 2)`` of cells with a pixel.

    only: ``(h, w)`` pixels; None for all. Light at a pixel is interpolated between the
    four corners of its cell.
    """
    height, width = size
    rows, columns = height // stride + 1, width // stride + 1
    if only is None:
        return np.ones((rows + 1, columns + 1), np.bool_)
    whole = np.zeros((rows * stride, columns * stride), np.bool_)
    whole[:height, :width] = only
    cells = whole.reshape(rows, stride, columns, stride).any(axis=(1, 3))
    points = np.zeros((rows + 1, columns + 1), np.bool_)
    for down in (0, 1):
        for right in (0, 1):
            points[down : down + rows, right : right + columns] |= cells
    return points


def dilated(points: Mask, reach: int) -> Mask:
    """Mark all points within a square of so many to either side of a marked one."""
    if reach == 0 or points.all():
        return points
    width = 2 * reach + 1
    for axis in (0, 1):
        beyond = [(0, 0), (0, 0)]
        beyond[axis] = reach + 1, reach
        sums = np.pad(points, beyond).cumsum(axis=axis)
        at = np.arange(points.shape[axis])
        points = sums.take(at + width, axis) > sums.take(at, axis)
    return points


def pixels_of(points: Mask, stride: int, size: tuple[int, int]) -> Mask:
    """Mark the pixels ``(h, w)`` that points are."""
    rows, columns = np.nonzero(points)
    pixels = np.zeros(size, np.bool_)
    pixels[
        np.minimum(rows * stride, size[0] - 1),
        np.minimum(columns * stride, size[1] - 1),
    ] = True
    return pixels
