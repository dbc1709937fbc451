"""Triangles into a depth buffer in plain numpy: every row of every triangle's box."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.scene.kernels.triangles import NEAREST_MM, row_span, slope


def fill_facets(
    places: NDArray[np.float64],
    boxes: NDArray[np.int32],
    count: int,
    flat: bool,
    lens: NDArray[np.float32],
    depth: NDArray[np.float32],
    owner: NDArray[np.int32],
    begin: int,
    end: int,
) -> tuple[int, int]:
    """Lower depths to the nearest of the listed triangles' and note whose they are.

    Arguments and results are those of `renderers.scene.kernels.fill_triangles`.
    """
    least, most = depth.shape[1], 0
    from_ = np.float32(0 if flat else NEAREST_MM)
    for place, (n, left, right, first_row, last_row) in zip(
        places[:count], boxes[:count].tolist(), strict=True
    ):
        edges, offsets = place[:9].reshape(3, 3), place[9:12]
        px, py, qx, qy, rx, ry, margin = (float(p) for p in place[12:19])
        slopes = slope(px, py, qx, qy), slope(qx, qy, rx, ry), slope(rx, ry, px, py)
        for y in range(max(first_row, begin), min(last_row + 1, end)):
            least, most = min(least, left), max(most, right + 1)
            span: Any = row_span(
                (px, py, qx, qy, rx, ry), slopes, margin, y, left, right
            )
            columns = np.arange(span[0], span[1] + 1)
            dx, dy, dz = lens[y, columns].astype(np.float64).T
            u, v, w = (dx * e[0] + dy * e[1] + dz * e[2] for e in edges)
            total = u + v + w
            inside = (u >= 0) & (v >= 0) & (w >= 0) | (u <= 0) & (v <= 0) & (w <= 0)
            inside &= total != 0
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                way = u * offsets[0] + v * offsets[1] + w * offsets[2]
                t = ((way if flat else offsets[0]) / total).astype(np.float32)
            nearer = inside & (t > from_) & (t < depth[y, columns])
            depth[y, columns[nearer]] = t[nearer]
            owner[y, columns[nearer]] = n
    return least, most
