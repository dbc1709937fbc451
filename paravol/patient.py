"""The head on the table, ready to be drawn: phantom or case, scene, landmarks."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from anatomy import PhantomParameters, classic_transfer_function, sinus_phantom
from anatomy.case import read_case
from anatomy.phantom.head_skin import head_skin
from anatomy.scan.approach import Approach
from anatomy.tissue import Label
from disk import UserError
from paravol.slice_views import SECOND, SliceViews
from renderers.scene import AirSurface, Scene, Volume
from scenarios import Scenario, Structures

SKIN_MM = 2.0
"""Voxels of a phantom's whole head: it is only looked at from outside."""

Progress = Callable[[str, float], None]
"""Called with what is being done and the done share, 0 to 1."""


@dataclass(frozen=True, slots=True)
class OperatingRoom:
    """Hold what every picture of a session shares.

    landmarks: world positions ``(3,)`` in mm by name; paired ones carry their side,
        as in ``"maxillary ostium right"``.
    surface_sha256: hash of the air distance values and where they lie.
    way_in: where a scope enters a patient's own head; None for a phantom, whose
        landmarks say it.
    others: further scans of the head on the scene's grid, by their names in the case.
    structures: what names the places that a tool touches.
    face: gives the distance to the skin of the whole head, mm, negative in the room,
        on a coarse grid of its own; None where nobody knows it. A phantom's takes half
        a second.
    """

    scene: Scene
    landmarks: dict[str, NDArray[np.float64]]
    surface_sha256: str
    way_in: Approach | None = None
    others: Mapping[str, Volume] = field(default_factory=dict)
    structures: Structures | None = None
    face: Callable[[], Volume] | None = None

    @property
    def surface(self) -> AirSurface:
        """Get the surface that the endoscope sees."""
        assert self.scene.surface is not None
        return self.scene.surface

    def slice_views(self) -> SliceViews:
        """Get what navigation slices are cut from."""
        volumes = {"ct": self.scene.volume, **self.others}
        return SliceViews.of(volumes, self.scene.transfer_function)

    def positions(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Look landmarks up; ValueError names an unknown one and those there are."""
        unknown = [name for name in names if name not in self.landmarks]
        if unknown:
            raise UserError(
                f"The head has no landmark {unknown[0]!r}; it has: "
                f"{'; '.join(sorted(self.landmarks))}."
            )
        return {name: self.landmarks[name] for name in names}


def prepare_room(scenario: Scenario, progress: Progress) -> OperatingRoom:
    """Build the scenario's head, fetch it from the cache, or read its case.

    Raises ValueError for a case that cannot be flown.
    """
    head = scenario.head
    if head.case:
        return case_room(Path(head.case), progress)
    phantom = sinus_phantom(
        PhantomParameters(seed=head.seed),
        spacing_mm=head.spacing_mm,
        progress=lambda stage, share: progress(f"Head: {stage}", share),
    )
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    scene = Scene(phantom.ct, classic_transfer_function(), surface=surface)
    landmarks = {
        name: np.asarray(landmark.position_mm)
        for name, landmark in phantom.landmarks.items()
    }
    label_names = {int(v): v.name.lower().replace("_", " ") for v in Label}
    return OperatingRoom(
        scene,
        landmarks,
        surface_hash(surface),
        structures=Structures.of(
            phantom.distance, phantom.labels, label_names, landmarks
        ),
        face=partial(head_skin, phantom.parameters, SKIN_MM),
    )


def case_room(folder: Path, progress: Progress) -> OperatingRoom:
    """Read a patient from a case folder; ValueError where it cannot be flown."""
    stage = "Head: reading the case"
    progress(stage, 0.0)
    case = read_case(folder)
    lacking = [n for n in ("distance", "blood", "skin") if n not in case.volumes]
    if lacking:
        raise UserError(
            f"The case {folder} has no {lacking[0]} volume, which a flight needs; "
            "make it again with paravol import or paravol phantom."
        )
    volumes = case.volumes
    surface = AirSurface(volumes["distance"], volumes["blood"], volumes["skin"])
    landmarks = {name: mark.position_mm for name, mark in case.landmarks.items()}
    way = case.record.approach
    way_in = None
    if way is not None:
        way_in = Approach(np.array(way.pivot_mm), np.array(way.axis), way.free_mm)
    stored = case.record.transfer
    transfer = classic_transfer_function() if stored is None else stored.function()
    scene = Scene(case.ct, transfer, surface=surface)
    progress(stage, 1.0)
    others = {name: volumes[name] for name in SECOND if name in volumes}
    label_names = {int(v): name for v, name in case.record.label_names.items()}
    skin = volumes.get("face")
    return OperatingRoom(
        scene,
        landmarks,
        surface_hash(surface),
        way_in,
        others,
        Structures.of(surface.distance, case.labels, label_names, landmarks),
        None if skin is None else lambda: skin,
    )


def surface_hash(surface: AirSurface) -> str:
    """Hash the distance values, their grid, the tint: all that a picture depends on."""
    digest = hashlib.sha256()
    for volume in (surface.distance, surface.blood, surface.skin):
        digest.update(repr(volume.shape).encode())
        digest.update(volume.world_from_voxel.tobytes())
        digest.update(volume.values.tobytes())
    return digest.hexdigest()
