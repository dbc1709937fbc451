"""What is counted and measured on a phantom: volumes, drainage, distances, error."""

import itertools

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.frame import lps_from_ras
from anatomy.phantom.ethmoid import basal_lamella, fovea
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, distance_at
from anatomy.phantom.spread import moved, spread_waves, unmoved
from anatomy.queries.landmarks import Landmark
from anatomy.tissue import Label, Side
from system import UserError

SIDES = (Side.RIGHT, Side.LEFT)

SINUSES = {
    "maxillary": (Label.MAXILLARY_AIR,),
    "frontal": (Label.FRONTAL_AIR,),
    "sphenoid": (Label.SPHENOID_AIR,),
    "ethmoid": (
        Label.ANTERIOR_ETHMOID_AIR,
        Label.POSTERIOR_ETHMOID_AIR,
        Label.VARIANT_CELL_AIR,
    ),
}
"""Labels of a sinus's air."""

PLUG_MM = {"maxillary": 4.0, "frontal": 4.0, "sphenoid": 3.2}
"""Radius of the ball that stops an ostium; the ways are narrower there."""

_STEP_MM = 0.02
"""Step of the differences that give the model's slope."""


def volume_ml(phantom: Phantom, labels: tuple[Label, ...], side: Side) -> float:
    """Measure the voxels of some labels on one side, mL."""
    inside = np.isin(phantom.labels.values, labels)
    count = np.count_nonzero(inside & (phantom.sides.values == side))
    return float(count * phantom.spacing_mm**3 / 1000)


def sinus_volumes_ml(phantom: Phantom, side: Side) -> dict[str, float]:
    """Measure each of `SINUSES` on one side, mL."""
    return {name: volume_ml(phantom, labels, side) for name, labels in SINUSES.items()}


def anterior_share(phantom: Phantom, side: Side) -> float:
    """Return the share of the ethmoid's air that is not behind the basal lamella."""
    rear = volume_ml(phantom, (Label.POSTERIOR_ETHMOID_AIR,), side)
    return 1 - rear / volume_ml(phantom, SINUSES["ethmoid"], side)


def leaks(phantom: Phantom, plug_mm: dict[str, float] | None = None) -> list[str]:
    """List sinuses that do not drain through their ostium alone.

    A ball is put into each ostium, an accessory one too; what then still joins the
    nose, or was no air at the sinus's middle, is named. plug_mm: radii of the balls in
    the average head, `PLUG_MM` if None. A missing frontal sinus is passed over. Raise
    UserError for a volume that does not hold the sinuses.
    """
    air = phantom.distance.values < 0
    marks = phantom.landmarks
    found = []
    for (sinus, reach), side in itertools.product((plug_mm or PLUG_MM).items(), SIDES):
        if sinus == "frontal" and phantom.parameters.scale("frontal", side) == 0:
            continue
        name = side.name.lower()
        rest = air.copy()
        for ostium in (f"{sinus} ostium, {name}", f"accessory {sinus} ostium, {name}"):
            if ostium in marks:
                _plug(phantom, marks[ostium], reach, rest)
        pieces, _ = ndimage.label(rest)
        inside = pieces[_voxel(phantom, marks[f"{sinus} sinus, {name}"])]
        nose = pieces[_voxel(phantom, marks["nasopharynx"])]
        if inside == 0 or nose == 0 or inside == nose:
            found.append(f"{sinus} {name}")
    return found


def _plug(
    phantom: Phantom, ostium: Landmark, radius_mm: float, air: NDArray[np.bool_]
) -> None:
    """Put a ball of the average head into an ostium."""
    scale = phantom.parameters.head_scale
    waves = spread_waves(phantom.parameters)
    middle = np.array(_voxel(phantom, ostium))
    most = int(2 * radius_mm * scale / phantom.spacing_mm) + 1
    low = np.maximum(middle - most, 0)
    high = np.minimum(middle + most + 1, air.shape)
    index = np.indices(high - low).reshape(3, -1).T + low
    places = phantom.ct.origin_mm + phantom.spacing_mm * index[:, ::-1]
    both = np.vstack([ostium.position_mm, places])
    at = moved(lps_from_ras(both) / scale, waves)
    inside = np.linalg.norm(at[1:] - at[0], axis=1) <= radius_mm
    air[tuple(index[inside].T)] = False


def _voxel(phantom: Phantom, landmark: Landmark) -> tuple[int, ...]:
    at = np.round((landmark.position_mm - phantom.ct.origin_mm) / phantom.spacing_mm)
    index = tuple(int(i) for i in at[::-1])
    if not all(0 <= i < n for i, n in zip(index, phantom.ct.shape, strict=True)):
        raise UserError(
            f"the {landmark.key} at {landmark.position_mm} mm lies outside the volume; "
            f"build the phantom with the whole field of view"
        )
    return index


def spine_distances_mm(parameters: PhantomParameters) -> dict[str, float]:
    """Measure from the anterior nasal spine to what a surgeon looks for, mm.

    The line to the basal lamella, where it is nearest in the average head, is followed
    to the skull base.
    """
    waves = spread_waves(parameters)
    z = np.linspace(24, 46, 400)
    plate = np.stack([np.full_like(z, 9.0), np.zeros_like(z), z])
    plate[1] = basal_lamella(parameters, Side.RIGHT).evaluate(plate)
    nearest = int(np.argmin(np.linalg.norm(plate, axis=0)))
    lamella = unmoved(plate.T[[nearest]], waves)[0]
    length = np.linalg.norm(lamella)
    along = np.linspace(40, 90, 2000)
    line = moved(lamella / length * along[:, None], waves).T
    over = np.argmax(line[2] > fovea(parameters).evaluate(line))
    recess = np.array([[8.0], [-13.0], [50.0]])
    top = float(fovea(parameters).evaluate(recess)[0])
    marks = np.array([[8, -13, top], [3.6, -54.0, 34.5], [0, -3.0, 51.0]])
    far = np.linalg.norm(unmoved(marks, waves) * [0, 1, 1], axis=1)
    face = unmoved(marks, waves)[1]
    found = {
        "basal lamella": length,
        "skull base behind it": along[over],
        "skull base at the recess": far[0],
        "sphenoid face": np.linalg.norm(face),
        "nasofrontal beak": far[2],
    }
    return {name: parameters.head_scale * float(mm) for name, mm in found.items()}


def surface_errors_mm(phantom: Phantom, count: int = 4000) -> NDArray[np.float64]:
    """Measure how far the stored zero set is from the model's, mm, at some voxels.

    At up to `count` voxels within half a voxel of the surface, the model's value over
    its slope against the stored distance, where the model is smooth.
    """
    rng = np.random.default_rng(0)
    h = phantom.spacing_mm
    near = np.argwhere(np.abs(phantom.distance.values) < 0.5 * h)
    near = near[rng.choice(len(near), min(count, len(near)), replace=False)]
    points = phantom.ct.origin_mm + h * near[:, ::-1]
    steps = _STEP_MM * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    values = distance_at(phantom.parameters, points[:, None] + steps)
    slope = np.linalg.norm(values[:, 1:4] - values[:, 4:7], axis=1) / (2 * _STEP_MM)
    smooth = slope > 0.5
    stored = phantom.distance.values[tuple(near[smooth].T)]
    errors: NDArray[np.float64] = np.abs(values[smooth, 0] / slope[smooth] - stored)
    return errors
