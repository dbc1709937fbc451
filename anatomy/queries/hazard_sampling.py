"""Sample the distances to a phantom's hazards on its grid."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import FARTHEST_MM, UNIT_MM, HazardVolumes
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import Chain, Field
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
        for name, field in hazard_fields(parameters, Side.RIGHT).items():
            values = np.full(distance.shape, np.float32(1e3))
            boxes = [
                (side, _near(axes, side, field, parameters.head_scale))
                for side in _SIDES
            ]

            def fill(
                z: int,
                name: str = name,
                values: NDArray[np.float32] = values,
                boxes: list[tuple[Side, tuple[slice, ...]]] = boxes,
            ) -> None:
                for side, (columns, rows, layers) in boxes:
                    if not layers.start <= z < layers.stop:
                        continue
                    size = 3, len(axes[1][rows]), len(axes[0][columns])
                    ras = np.empty(size, np.float32)
                    ras[0], ras[2] = -axes[0][columns], axes[2][z]
                    ras[1] = -axes[1][rows][:, None]
                    found = hazard_values(parameters, side, name, ras.reshape(3, -1).T)
                    plane = values[z, rows, columns]
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


def _near(
    axes: list[NDArray[np.float64]], side: Side, field: Field, head_scale: float
) -> tuple[slice, ...]:
    """Return the columns, rows and layers that a side's structure is near.

    axes: LPS x, y, z of the voxels. A tube has no distance to tell beyond
    `FARTHEST_MM`, the bent septum moves it by less than `BENT_MM`.
    """
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    if isinstance(field, Chain):
        points = np.array(field.points) * head_scale
        room = FARTHEST_MM + head_scale * max(field.radii) + np.array([BENT_MM, 0, 0])
        low, high = points.min(axis=0) - room, points.max(axis=0) + room
    # LPS y points backwards, x to the patient's left.
    low[1], high[1] = -high[1], -low[1]
    low[0] = max(low[0], -BENT_MM)
    if side == Side.RIGHT:
        low[0], high[0] = -high[0], -low[0]
    return tuple(
        slice(
            int(np.searchsorted(axis, least)),
            int(np.searchsorted(axis, most, side="right")),
        )
        for axis, least, most in zip(axes, low, high, strict=True)
    )
