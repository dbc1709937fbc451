"""Disease as the volumes show it: Lund-Mackay scores, and what cannot drain."""

import msgspec
import numpy as np
from scipy import ndimage

from anatomy.phantom.air import LARGEST_SLIVER_ML
from anatomy.phantom.fixed_shapes import course
from anatomy.phantom.parameters import SINUSES, Opacity, PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.phantom.variants import is_healthy
from anatomy.queries.landmarks import septal_shift
from anatomy.tissue import AIR_LABELS, Label, Side
from system import UserError

CLEAR_BELOW, FULL_ABOVE = 0.02, 0.98
"""Opaque shares of a sinus at which its score changes."""

_AIR = {
    **{sinus: Label[f"{sinus.upper()}_AIR"] for sinus in SINUSES},
    "variant_cell": Label.VARIANT_CELL_AIR,
}
"""The label of each sinus's air."""


def healthy(parameters: PhantomParameters) -> PhantomParameters:
    """Return the same head without disease; what surgery did to it stays."""
    return msgspec.structs.replace(
        parameters, opacity=(Opacity(), Opacity()), findings=()
    )


def lund_mackay(phantom: Phantom, twin: Phantom | None = None) -> dict[Side, Opacity]:
    """Recount both sides' scores from the label map; polyps are not counted.

    twin: the same head without disease, on the same grid; None builds it. A sinus's
    score compares its air with the twin's; an absent sinus counts 0. The ostiomeatal
    complex is blocked if no voxel along the infundibulum holds air.
    """
    whole = twin
    if whole is None and is_healthy(phantom.parameters):
        whole = phantom
    if whole is None:
        whole = build_phantom(
            healthy(phantom.parameters), phantom.spacing_mm, field_mm=_field(phantom)
        )
    if whole.labels.shape != phantom.labels.shape:
        raise UserError(
            f"the healthy twin must share the grid {phantom.labels.shape}, got "
            f"{whole.labels.shape}"
        )
    found = {}
    for side in (Side.RIGHT, Side.LEFT):
        scores = {}
        for sinus in SINUSES:
            label = _AIR[sinus]
            space = (whole.labels.values == label) & (whole.sides.values == side)
            room = np.count_nonzero(space)
            air = np.count_nonzero(space & (phantom.labels.values == label))
            share = 1 - air / room if room else 0.0
            scores[sinus] = int(share >= CLEAR_BELOW) + int(share > FULL_ABOVE)
        scores["ostiomeatal"] = 0 if _is_open(phantom, side) else 2
        found[side] = Opacity(**scores)
    return found


def _is_open(phantom: Phantom, side: Side) -> bool:
    """Return whether there is air along the lower infundibulum."""
    ends = np.array(course("maxillary ostium").points)
    along = np.linspace(0, 1, 25)[:, None]
    way = ends[0] * (1 - along) + ends[1] * along
    labels = phantom.labels.nearest(septal_shift(phantom.parameters, way, side))
    return bool(np.isin(labels, list(AIR_LABELS)).any())


def _field(
    phantom: Phantom,
) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
    low = phantom.ct.origin_mm
    high = low + phantom.ct.spacing_mm * (np.array(phantom.ct.shape[::-1]) - 1)
    x, y, z = ((float(a), float(b)) for a, b in zip(low, high, strict=True))
    return x, y, z


def trapped_sinuses(phantom: Phantom) -> tuple[str, ...]:
    """Name sinuses that hold air without a way to the nose, such as ``frontal, left``.

    Their ostium is blocked, or they drain into a neighbour that disease has filled.
    Pockets below `LARGEST_SLIVER_ML` and air that reaches the volume's border do not
    count.
    """
    pieces, count = ndimage.label(phantom.distance.values < 0)
    if count <= 1:
        return ()
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)
    sizes[0] = 0
    is_shut = sizes >= LARGEST_SLIVER_ML * 1000 / phantom.spacing_mm**3
    is_shut[np.argmax(sizes)] = False
    for axis in range(3):
        is_shut[np.unique(np.take(pieces, [0, -1], axis=axis))] = False
    if not is_shut.any():
        return ()
    shut = is_shut[pieces]
    labels, sides = phantom.labels.values[shut], phantom.sides.values[shut]
    return tuple(
        f"{name.replace('_', ' ')}, {side.name.lower()}"
        for name, label in _AIR.items()
        for side in (Side.RIGHT, Side.LEFT)
        if np.any((labels == label) & (sides == side))
    )
