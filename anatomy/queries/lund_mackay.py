"""The Lund-Mackay score, recounted from a label map."""

import msgspec
import numpy as np
from numpy.typing import NDArray

from anatomy.phantom.findings import is_healthy
from anatomy.phantom.fixed_shapes import course
from anatomy.phantom.parameters import SINUSES, Opacity, PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.queries.landmarks import septal_shift
from anatomy.tissue import AIR_LABELS, Label, Side
from disk import UserError

CLEAR_BELOW, FULL_ABOVE = 0.02, 0.98
"""Opaque shares of a sinus at which its score changes."""

_AIR = {
    "maxillary": Label.MAXILLARY_AIR,
    "anterior_ethmoid": Label.ANTERIOR_ETHMOID_AIR,
    "posterior_ethmoid": Label.POSTERIOR_ETHMOID_AIR,
    "sphenoid": Label.SPHENOID_AIR,
    "frontal": Label.FRONTAL_AIR,
}


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
    ends = np.array(course("infundibulum").points[-2:])
    along = np.linspace(0, 1, 25)[:, None]
    way = ends[0] * (1 - along) + ends[1] * along
    labels = _nearest(phantom, septal_shift(phantom.parameters, way, side))
    return bool(np.isin(labels, list(AIR_LABELS)).any())


def _nearest(phantom: Phantom, points: NDArray[np.float64]) -> NDArray[np.uint8]:
    volume = phantom.labels
    index = np.round((points - volume.origin_mm) / volume.spacing_mm).astype(int)
    index = np.clip(index, 0, np.array(volume.shape[::-1]) - 1)
    values: NDArray[np.uint8] = volume.values[index[:, 2], index[:, 1], index[:, 0]]
    return values


def _field(
    phantom: Phantom,
) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
    low = phantom.ct.origin_mm
    high = low + phantom.ct.spacing_mm * (np.array(phantom.ct.shape[::-1]) - 1)
    x, y, z = ((float(a), float(b)) for a, b in zip(low, high, strict=True))
    return x, y, z
