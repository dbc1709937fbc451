"""The synthetic sinus phantom: a virtual patient for one set of parameters."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from anatomy.phantom import air
from anatomy.phantom.air import remove_slivers
from anatomy.phantom.coverage import paint
from anatomy.phantom.ct_noise import ct_noise
from anatomy.phantom.head import WHOLE_HEAD_MM
from anatomy.phantom.lattice import Box, Lattice, field_for
from anatomy.phantom.model import build_model
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.sphenoid import rear_mm
from anatomy.phantom.spread import around_spread, spread_waves
from anatomy.phantom.walls import wall_layers
from anatomy.queries.hazards import sample_hazards
from anatomy.queries.landmarks import Landmark, landmarks
from anatomy.redistance import DEEPEST_MM, FARTHEST_MM, redistance
from anatomy.tissue import Label, Side
from anatomy.wall_layers import WallLayers
from renderers.scene.volume import AIR_HU, Volume
from system import UserError

_MEDIAL_MM = 8.0
"""The septum deviates by less than this; beyond it x alone tells the side."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class Phantom:
    """One virtual patient; all volumes share one grid in LPS.

    ct: int16 HU. labels: uint8 `Label`. sides: uint8 `Side`. bone_cover: uint8, 255
    is all bone. distance: float32 mm to the air boundary, negative in air, zero on
    the surface that is shown. blood: uint8, fraction ``(v / 255)^2``. skin: uint8
    weight of dry skin, 255 is all. layers: what lies behind the surface. hazards:
    distances to what must not be hurt.
    """

    parameters: PhantomParameters
    ct: Volume
    labels: Volume
    sides: Volume
    bone_cover: Volume
    distance: Volume
    blood: Volume
    skin: Volume
    landmarks: dict[str, Landmark]
    layers: WallLayers
    hazards: HazardVolumes

    @property
    def spacing_mm(self) -> float:
        """Return the edge of the cubic voxels."""
        return float(self.ct.spacing_mm[0])


def build_phantom(
    parameters: PhantomParameters,
    spacing_mm: float = 0.5,
    progress: Progress | None = None,
    threads: int | None = None,
    field_mm: Box | None = None,
) -> Phantom:
    """Build a virtual patient.

    field_mm: LPS ranges of x, y, z; None takes nose and sinuses. progress: called
    with a stage and its finished share. threads: None takes all processors; the
    result does not depend on it.
    Raise UserError for a spacing outside [0.2, 3] mm.
    """
    workers = air.default_threads() if threads is None else threads
    if workers < 1:
        raise UserError(f"threads must be at least 1, got {threads}")

    def report(stage: str) -> Callable[[float], None] | None:
        return None if progress is None else lambda share: progress(stage, share)

    model = build_model(parameters)
    lattice = Lattice.covering(spacing_mm, field_mm or whole_field(parameters))
    grids, _ = air.evaluate_lattice(
        model, lattice, workers, progress=report("evaluating the air function")
    )
    if parameters.spread_mm:
        air.seal_cavities(grids.air, grids.part, [p.cavity for p in model.parts])
    remove_slivers(grids.air, grids.part, spacing_mm)
    if progress is not None:
        progress("measuring distances", 0.0)
    distance = redistance(grids.air, spacing_mm, workers)

    def run(work: Callable[[int, int], None], total: int) -> None:
        air.run_in_ranges(work, total, workers, 16, report("painting tissues"))

    painted = paint(model, grids, distance, spacing_mm, run)
    if parameters.ct_noise_hu > 0:
        noise = ct_noise(lattice, parameters.seed, parameters.ct_noise_hu)
        noise += painted.hu
        np.rint(noise, out=noise)
        np.clip(noise, -1024, 3071, out=noise)
        painted.hu[...] = noise
    sides = _sides(lattice, grids.part, painted.labels, model.tables.parts[:, 2])

    def volume(values: NDArray[np.generic], background: float) -> Volume:
        return Volume(
            values, np.full(3, spacing_mm), lattice.origin_mm, background=background
        )

    stored = volume(distance, FARTHEST_MM)
    if progress is not None:
        progress("measuring hazards", 0.0)
    hazards = sample_hazards(parameters, stored, workers)
    return Phantom(
        parameters,
        volume(painted.hu, AIR_HU),
        volume(painted.labels, 0.0),
        volume(sides, 0.0),
        volume(painted.bone_cover, 0.0),
        stored,
        volume(grids.blood, 0.0),
        volume(grids.skin, 0.0),
        landmarks(parameters),
        wall_layers(model, grids, stored, hazards),
        hazards,
    )


def whole_field(parameters: PhantomParameters) -> Box:
    """Choose LPS ranges of x, y, z that hold the nose and all sinuses."""
    tallest = max(parameters.scale("frontal", side) for side in (Side.LEFT, Side.RIGHT))
    rear = min(rear_mm(parameters, side) for side in (Side.LEFT, Side.RIGHT))
    return around_spread(
        field_for(parameters.head_scale, tallest, -rear),
        parameters.head_scale,
        spread_waves(parameters),
    )


def distance_at(
    parameters: PhantomParameters, points_mm: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Evaluate the air function at ``(..., 3)`` LPS points, without any volume.

    Negative in air; the zero set is the mucosal surface, the magnitude only close to
    a distance. A phantom's `distance` has the same sign at its voxels.
    """
    return air.distance_at_points(build_model(parameters), points_mm)


def _sides(
    lattice: Lattice,
    part: NDArray[np.uint8],
    labels: NDArray[np.uint8],
    part_side: NDArray[np.int32],
) -> NDArray[np.uint8]:
    """Tell right from left: near the midline by the part next to it, else by x."""
    x = lattice.origin_mm[0] + lattice.spacing_mm * np.arange(lattice.count[0])
    by_place = np.where(x > 0, Side.LEFT, Side.RIGHT).astype(np.uint8)
    table = np.zeros(256, dtype=np.uint8)
    table[: len(part_side)] = np.where(part_side > 0, Side.RIGHT, Side.LEFT)
    sides = table[part]
    lateral = (np.abs(x) > _MEDIAL_MM)[None, None, :] | (part == 255)
    sides = np.where(lateral, by_place[None, None, :], sides)
    middle = np.zeros(256, dtype=np.bool_)
    middle[
        [
            Label.OUTSIDE_AIR,
            Label.NASOPHARYNX_AIR,
            Label.SEPTAL_BONE,
            Label.SEPTAL_CARTILAGE,
        ]
    ] = True
    sides[middle[labels]] = Side.MIDLINE
    return sides


COARSE_MM = 1.5
"""Voxels of the whole head, as of an imported one."""


def head_skin(
    parameters: PhantomParameters,
    spacing_mm: float = COARSE_MM,
    threads: int | None = None,
) -> Volume:
    """Measure the signed distance to the head's outside, float32 mm.

    Negative in the room, on a grid of its own that holds the head and the neck; air
    inside the head counts as tissue, so that only skin is a surface. Raise UserError
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
