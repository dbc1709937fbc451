"""Sample the distances to a phantom's hazards on its grid."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import FARTHEST_MM, UNIT_MM, HazardVolumes
from anatomy.phantom.parameters import PhantomParameters
from anatomy.queries.hazards import EXACT, hazard_fields, hazard_values
from anatomy.redistance import signed_distance
from anatomy.tissue import Side
from renderers.scene.volume import Volume

BENT_MM = 8.0
"""A septum deviates by less: further out only the near side's structure counts."""

_SIDES = (Side.RIGHT, Side.LEFT)


def sample_hazards(
    parameters: PhantomParameters, distance: Volume, threads: int = 1
) -> HazardVolumes:
    """Measure every voxel of a head's grid to the hazards of `hazard_distances`.

    distance: the head's signed air distance, whose grid is taken. Of both sides the
    nearer structure counts. Orbit, skull base and septum become true distances to
    their surfaces, where `hazard_distances` is first order. The result does not depend
    on `threads`.
    """
    spacing = float(distance.spacing_mm[0])
    axes = [
        (distance.origin_mm[a] + spacing * np.arange(n))
        for a, n in enumerate(distance.shape[::-1])
    ]
    air = -np.asarray(distance.values)
    volumes = {}
    with ThreadPoolExecutor(max_workers=threads) as pool:
        for name in hazard_fields(parameters, Side.RIGHT):
            values = np.full(distance.shape, np.float32(1e3))

            def fill(
                z: int, name: str = name, values: NDArray[np.float32] = values
            ) -> None:
                for side, columns in _halves(axes[0]):
                    size = 3, len(axes[1]), len(axes[0][columns])
                    ras = np.empty(size, np.float32)
                    ras[0], ras[2] = -axes[0][columns], axes[2][z]
                    ras[1] = -axes[1][:, None]
                    found = hazard_values(parameters, side, name, ras.reshape(3, -1).T)
                    plane = values[z][:, columns]
                    np.minimum(plane, found.reshape(plane.shape), out=plane)

            list(pool.map(fill, range(len(axes[2]))))
            if name not in EXACT:
                limits = FARTHEST_MM, FARTHEST_MM
                values = signed_distance(values, spacing, *limits, threads)
            # Where a structure and a sinus claim one place, the air has it.
            np.maximum(values, air, out=values, where=air > 0)
            np.clip(values, -FARTHEST_MM, FARTHEST_MM, out=values)
            steps = np.rint(values / np.float32(UNIT_MM)).astype(np.int16)
            volumes[name] = distance.with_values(steps, FARTHEST_MM / UNIT_MM)
    return HazardVolumes(volumes)


def _halves(x: NDArray[np.float64]) -> Iterator[tuple[Side, slice]]:
    """Yield either side and the columns, of LPS x, that its structures are near."""
    # LPS x points to the patient's left.
    left = int(np.searchsorted(x, -BENT_MM))
    right = int(np.searchsorted(x, BENT_MM, side="right"))
    for side, columns in zip(
        _SIDES, (slice(0, right), slice(left, len(x))), strict=True
    ):
        if columns.stop > columns.start:
            yield side, columns
