"""A patient: a phantom or a case, its scene and landmarks, and pictures of it."""

import hashlib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray
from platformdirs import user_cache_dir

from anatomy import (
    PhantomParameters,
    classic_transfer_function,
    draw_parameters,
    sinus_phantom,
)
from anatomy.abstract import LABELS, build_scene
from anatomy.case import read_case
from anatomy.hazard_volumes import HazardVolumes
from anatomy.phantom.parameters import Opacity
from anatomy.phantom.phantom import head_skin
from anatomy.phantom.variants import with_findings, with_variants
from anatomy.scan.approach import Approach
from anatomy.tissue import Label
from anatomy.wall_layers import WallLayers
from paravol.slices.slice_views import SECOND, SliceViews
from renderers.scene import AirSurface, Scene, Volume
from scenarios import Scenario, Structures, tip_frame
from surgery.decongestion import BLOOD_BIAS, decongest
from system import UserError, usable_cores

SKIN_MM = 2.0
"""Voxels of a phantom's whole head: it is only looked at from outside."""

Progress = Callable[[str, float], None]
"""Called with what is being done and the done share, 0 to 1."""

StrPath = str | os.PathLike[str]


def no_progress(stage: str, share: float) -> None:
    """Ignore progress."""


@dataclass(frozen=True)
class PatientScene:
    """A patient's head and draw it.

    World is the patient's LPS frame in mm; volumes are indexed ``[z, y, x]``.
    scene: its ``volume`` is the CT, ``surface.distance`` the signed distance to the
        wall of the airway, mm, negative in air.
    landmarks: positions ``(3,)`` by name; paired ones carry their side, as in
        ``"maxillary ostium, right"``.
    surface_sha256: hash of the air distance values and where they lie.
    way_in: where a scope enters a patient's own head, or a scene; None for a phantom,
        whose landmarks say it.
    others: further scans of the head on the scene's grid, by their names in the case.
    structures: what names the places that a tool touches.
    face: gives the distance to the skin of the whole head, mm, negative in the room,
        on a coarse grid of its own; None where it is unknown. A phantom's takes half a
        second.
    layers: what lies behind the surface; None where nobody knows.
    hazards: distances to what must not be hurt; None where nobody knows.
    blood_bias: factor on how it bleeds; its surface has the blood that it shows.
    detail_seed: of the tissue's fine detail: its vessels, mottle and hairs.
    """

    scene: Scene
    landmarks: dict[str, NDArray[np.float64]]
    surface_sha256: str
    way_in: Approach | None = None
    others: Mapping[str, Volume] = field(default_factory=dict)
    structures: Structures | None = None
    face: Callable[[], Volume] | None = None
    layers: WallLayers | None = None
    hazards: HazardVolumes | None = None
    blood_bias: float = 1.0
    detail_seed: int = 1

    @property
    def surface(self) -> AirSurface:
        """Return the surface that the endoscope sees."""
        assert self.scene.surface is not None
        return self.scene.surface

    @property
    def structures_sha256(self) -> str:
        """Return a hash of what names the structures; "" where none are named."""
        return "" if self.structures is None else self.structures.sha256()

    @property
    def hazards_sha256(self) -> str:
        """Return a hash of the distances to hazards; "" where they are unknown."""
        return "" if self.hazards is None else self.hazards.sha256()

    def slice_views(self) -> SliceViews:
        """Return what navigation slices are cut from."""
        volumes = {"ct": self.scene.volume, **self.others}
        return SliceViews.of(volumes, self.scene.transfer_function)

    def positions(self, names: tuple[str, ...]) -> dict[str, NDArray[np.float64]]:
        """Look landmarks up; UserError names an unknown one and those there are."""
        unknown = [name for name in names if name not in self.landmarks]
        if unknown:
            raise UserError(
                f"The head has no landmark {unknown[0]!r}; it has: "
                f"{'; '.join(sorted(self.landmarks))}."
            )
        return {name: self.landmarks[name] for name in names}

    def pose(
        self, eye: str | ArrayLike, target: str | ArrayLike, forward_mm: float = 0.0
    ) -> NDArray[np.float64]:
        """Return the pose of a scope that looks from one place at another.

        eye, target: names of landmarks, or points ``(3,)``. forward_mm: moves the tip
        from the eye towards the target. Return ``world_from_tip``, 4x4: +z runs back up
        the shaft. UserError for an unknown landmark or two equal places.
        """
        first, second = (
            self.positions((place,))[place]
            if isinstance(place, str)
            else np.asarray(place, np.float64)
            for place in (eye, target)
        )
        length = float(np.linalg.norm(second - first))
        if length == 0.0:
            raise UserError(f"the eye and the target are one place, {first.tolist()}")
        forward = (second - first) / length
        return tip_frame(first + forward_mm * forward, forward)


def thread_count() -> int:
    """Return the number of processors that this process may use."""
    return usable_cores()


def load_patient(scenario: Scenario, progress: Progress) -> PatientScene:
    """Build the scenario's head or scene, fetch it from the cache, or read its case.

    Raises UserError for a case that cannot be flown.
    """
    head = scenario.head
    if head.case:
        patient = load_case(Path(head.case), progress)
    elif head.scene:
        patient = load_scene(head.scene, head.seed, head.spacing_mm, progress)
    else:
        patient = load_phantom(
            head.number,
            head.spacing_mm,
            progress,
            variants=head.variants,
            polyps=(head.polyps_right, head.polyps_left),
            disease=head.disease,
            average=not head.patients,
        )
    return decongested(patient) if head.decongested else patient


def decongested(patient: PatientScene) -> PatientScene:
    """Return the patient with shrunk, pale mucosa that bleeds less.

    The CT stays as it was taken. UserError for a head without labels.
    """
    structures = patient.structures
    if structures is None:
        raise UserError(
            "This head has no labels, so nobody knows what of it would shrink; set "
            "decongested to false in its scenario."
        )
    folder = Path(user_cache_dir("paravol")) / "decongested"
    surface = decongest(patient.surface, structures.labels, folder=folder)
    return replace(
        patient,
        scene=replace(patient.scene, surface=surface),
        surface_sha256=surface_hash(surface),
        structures=replace(structures, distance=surface.distance),
        blood_bias=BLOOD_BIAS,
    )


def load_phantom(
    seed: int = 1,
    spacing_mm: float = 0.5,
    progress: Progress = no_progress,
    *,
    variants: tuple[str, ...] = (),
    polyps: tuple[int, int] = (0, 0),
    disease: tuple[str, ...] = (),
    average: bool = False,
) -> PatientScene:
    """Return a virtual patient, from the user's cache or built in some 10 s.

    seed: draws a patient: sizes, places, septum, skull base, cells and variants.
    average: take the average adult instead, whose cells alone the seed draws; with seed
    1 it is the patient of the bundled flights. spacing_mm: of the voxels. progress:
    called with what is being done and the share, 0 to 1. variants: added to its
    anatomy, as ``"onodi:left"`` or ``"concha-bullosa"``. polyps: their grades 0 to 4,
    right and left. disease: what else fills sinuses and what surgery left, as
    ``"fluid:maxillary:left=0.4"``, see `anatomy.phantom.variants`. UserError
    for an unknown variant or word.
    """
    right, left = polyps
    opacity = Opacity(polyps=right), Opacity(polyps=left)
    parameters = PhantomParameters(seed=seed) if average else draw_parameters(seed)
    parameters = msgspec.structs.replace(parameters, opacity=opacity)
    parameters = with_findings(with_variants(parameters, variants), disease)
    phantom = sinus_phantom(
        parameters,
        spacing_mm=spacing_mm,
        progress=lambda stage, share: progress(f"Head: {stage}", share),
    )
    surface = AirSurface(phantom.distance, phantom.blood, phantom.skin)
    scene = Scene(phantom.ct, classic_transfer_function(), surface=surface)
    landmarks = {
        name: np.asarray(landmark.position_mm)
        for name, landmark in phantom.landmarks.items()
    }
    label_names = {int(v): v.name.lower().replace("_", " ") for v in Label}
    return PatientScene(
        scene,
        landmarks,
        surface_hash(surface),
        structures=Structures.of(
            phantom.distance, phantom.labels, label_names, landmarks
        ),
        face=partial(head_skin, phantom.parameters, SKIN_MM),
        layers=phantom.layers,
        hazards=phantom.hazards,
        detail_seed=seed,
    )


def load_scene(
    name: str,
    seed: int = 1,
    spacing_mm: float = 0.5,
    progress: Progress = no_progress,
) -> PatientScene:
    """Return an abstract space to practise in, built in about two seconds.

    name: one of `anatomy.abstract.SCENES`. seed: varies its layout; an odd one is the
    one before it in a mirror. UserError for a name that there is not.
    """
    stage = f"Scene: {name}"
    progress(stage, 0.0)
    space = build_scene(name, seed, spacing_mm)
    progress(stage, 1.0)
    surface = AirSurface(space.distance, space.blood, space.skin)
    return PatientScene(
        Scene(space.ct, classic_transfer_function(), surface=surface),
        space.landmarks,
        surface_hash(surface),
        space.way_in,
        structures=Structures(
            space.distance,
            space.labels,
            {int(label): name for label, name in LABELS.items()},
            space.landmarks,
        ),
    )


def load_case(folder: StrPath, progress: Progress = no_progress) -> PatientScene:
    """Read a patient from a case, made by `paravol import` or `paravol phantom`.

    UserError where the folder holds no case, or one that cannot be flown.
    """
    folder = Path(folder)
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
    digest = surface_hash(surface)
    return PatientScene(
        scene,
        landmarks,
        digest,
        way_in,
        others,
        Structures.of(surface.distance, case.labels, label_names, landmarks),
        None if skin is None else lambda: skin,
        case.layers,
        case.hazards,
        detail_seed=int(digest[:7], 16),
    )


def surface_hash(surface: AirSurface) -> str:
    """Hash the distance values, their grid, the tint: all that a picture depends on."""
    digest = hashlib.sha256()
    for volume in (surface.distance, surface.blood, surface.skin):
        digest.update(repr(volume.shape).encode())
        digest.update(volume.world_from_voxel.tobytes())
        digest.update(volume.values.tobytes())
    return digest.hexdigest()
