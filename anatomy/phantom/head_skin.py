"""The skin of a phantom's whole head, which its field of view shows a part of."""

import numpy as np

from anatomy.phantom import air
from anatomy.phantom.head import WHOLE_HEAD_MM
from anatomy.phantom.lattice import Lattice
from anatomy.phantom.model import build_model
from anatomy.phantom.parameters import PhantomParameters
from anatomy.redistance import DEEPEST_MM, redistance
from renderers.scene.volume import Volume

COARSE_MM = 1.5
"""Voxels of the whole head, as of an imported one."""


def head_skin(
    parameters: PhantomParameters,
    spacing_mm: float = COARSE_MM,
    threads: int | None = None,
) -> Volume:
    """Measure the signed distance to the head's outside, float32 mm.

    Negative in the room, on a grid of its own that holds the head and the neck; air
    inside the head counts as tissue, so that only skin is a surface. Raise ValueError
    for a spacing outside [0.2, 3] mm.
    """
    workers = air.default_threads() if threads is None else threads
    k = parameters.head_scale
    x, y, z = ((k * low, k * high) for low, high in WHOLE_HEAD_MM)
    lattice = Lattice.covering(spacing_mm, (x, y, z))
    model = build_model(parameters)
    along = [
        start + spacing_mm * np.arange(n)
        for start, n in zip(lattice.origin_mm, lattice.count, strict=True)
    ]
    level = np.stack(np.meshgrid(along[1], along[0], indexing="ij")[::-1], axis=-1)
    level = np.concatenate([level, np.zeros((*level.shape[:2], 1))], axis=-1)
    field = np.empty(lattice.shape, dtype=np.float32)

    def fill(first: int, last: int) -> None:
        places = level.reshape(-1, 3).copy()
        for number in range(first, last):
            places[:, 2] = along[2][number]
            values = air.outside_at_points(model, places)
            field[number] = values.reshape(lattice.shape[1:])

    air.run_in_ranges(fill, lattice.shape[0], workers, 16)
    distance = redistance(field, spacing_mm, workers)
    spacing = np.full(3, spacing_mm)
    return Volume(distance, spacing, lattice.origin_mm, background=DEEPEST_MM)
