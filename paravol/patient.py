"""A patient: a phantom or a case, its scene and landmarks, and pictures of it."""

import hashlib
import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from anatomy import PhantomParameters, classic_transfer_function, sinus_phantom
from anatomy.abstract import LABELS, build_scene
from anatomy.case import read_case
from anatomy.hazard_volumes import HazardVolumes
from anatomy.phantom.parameters import Opacity
from anatomy.phantom.phantom import head_skin
from anatomy.phantom.variants import with_findings, with_variants
from anatomy.scan.approach import Approach
from anatomy.tissue import Label
from anatomy.wall_layers import WallLayers
from disk import UserError
from machine import usable_cores
from paravol.slice_views import SECOND, SliceViews
from renderers.scene import AirSurface, Camera, Change, Mesh, Scene, Volume
from scenarios import Endoscope, Scenario, Structures, View, tip_frame
from scenarios.instrument_state import FIRST_TOOL, NO_TOOL
from scenarios.instruments import instrument_named, placed_tool
from surgery.decongestion import BLOOD_BIAS, decongest

if TYPE_CHECKING:
    from paravol.snapshots.comparison import Difference
    from paravol.view import EndoscopeView
    from renderers.art import ActiveRayTracer
    from renderers.fsr import SplatActor

SKIN_MM = 2.0
"""Voxels of a phantom's whole head: it is only looked at from outside."""

Progress = Callable[[str, float], None]
"""Called with what is being done and the done share, 0 to 1."""

StrPath = str | os.PathLike[str]


def no_progress(stage: str, share: float) -> None:
    """Ignore progress."""


@dataclass(frozen=True, slots=True)
class Look:
    """Hold what the endoscope sees from one place.

    rgb: ``(h, w, 3)`` uint8 sRGB, row 0 at the top. depth_mm: ``(h, w)`` float32, along
    each pixel's ray, +inf where nothing is met. camera: its ``rays()`` give the rays,
    patient LPS, mm. gain: of the camera, for
    `PatientScene.look` to expose another picture alike. instrument_pose, instrument,
    jaw: as they were given.
    """

    rgb: NDArray[np.uint8]
    depth_mm: NDArray[np.float32]
    camera: Camera
    gain: float
    instrument_pose: NDArray[np.float64] | None = None
    instrument: str = FIRST_TOOL
    jaw: float = 1.0


@dataclass(frozen=True, slots=True)
class HighQualityPicture:
    """Hold the ray tracer's best picture of a `Look`.

    rgb, depth_mm: as those of `Look`. seconds: it took. difference: of the look's
    picture from this one, in 8-bit codes.
    """

    rgb: NDArray[np.uint8]
    depth_mm: NDArray[np.float32]
    seconds: float
    difference: "Difference"


@dataclass(frozen=True)
class PatientScene:
    """Hold a patient's head and draw it.

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

    def look(
        self,
        place: NDArray[np.float64] | Camera,
        *,
        renderer: Literal["fsr", "art"] = "fsr",
        size: int = 512,
        gain: float | None = None,
        instrument_pose: NDArray[np.float64] | None = None,
        instrument: str = FIRST_TOOL,
        jaw: float = 1.0,
    ) -> Look:
        """Draw what the endoscope sees, lit and exposed as in the trainer.

        place: ``world_from_tip`` of a straight scope of 80 degrees, 4x4, or a camera of
        any place, lens and size; `Endoscope.camera` makes that of other scopes.
        renderer: "fsr" splats, as the live picture does; "art" casts rays. Both are
        shaded alike. size: of the square picture, pixels. gain: of the camera; None
        exposes automatically. instrument_pose: ``world_from_instrument`` of a tool,
        4x4; None for none. instrument: its name. jaw: 0 open to 1 closed. The first
        picture takes seconds longer: the scene is prepared for it.
        """
        from renderers.shading import meter

        camera = place
        if not isinstance(camera, Camera):
            camera = Endoscope().camera(np.asarray(place), 0.0, (size, size))
        view, tool = self._view, np.eye(4)
        if instrument_pose is not None:
            tool = np.asarray(instrument_pose)
        name = NO_TOOL if instrument_pose is None else instrument
        seen = View(camera, np.eye(4), tool, 0.0, instrument=name, jaw=jaw)
        if renderer == "fsr":
            buffer = view.tissue(seen)
        elif renderer == "art":
            buffer = self._tracer.gbuffer(camera)
        else:
            raise UserError(f"the renderer is 'fsr' or 'art', got {renderer!r}")
        view.add_instrument(seen, buffer)
        radiance = view.light(seen, buffer)
        chosen = meter(radiance, buffer.material) if gain is None else gain
        pixels = view.expose(seen, buffer, radiance, gain=chosen, number=0)
        depth_mm = buffer.depth_mm
        return Look(pixels, depth_mm, camera, chosen, instrument_pose, instrument, jaw)

    def snapshot(
        self, look: Look, *, ranks: int = 1, progress: Progress = no_progress
    ) -> HighQualityPicture:
        """Have a look drawn again at high quality, by a worker process of its own.

        ranks: processes that share the work, over MPI where more than one. Takes from
        seconds to a minute. UserError when the worker cannot do it.
        """
        from paravol.session_setup import SEED
        from paravol.snapshots.comparison import difference
        from paravol.snapshots.rendering_service import running_worker
        from paravol.snapshots.spool_folder import own_spool
        from renderers.snapshots.client import SnapshotClient

        tools = []
        if look.instrument_pose is not None:
            tools = placed_tool(look.instrument, look.instrument_pose, look.jaw)
        with ExitStack() as stack:
            spool = stack.enter_context(own_spool())
            client = SnapshotClient(spool, name="paravol in Python")
            worker = stack.enter_context(running_worker(spool, ranks=ranks))
            request = client.request_scope(
                self.surface,
                look.camera,
                ring_radius_mm=Endoscope().ring_radius_mm,
                seed=SEED,
                gain=look.gain,
                instruments=tools,
            )
            job = client.submit(request)
            snapshot = client.wait(
                job, partial(progress, "Snapshot"), watch=worker.ensure_alive
            )
            pixels = snapshot.pixels()
            return HighQualityPicture(
                pixels,
                snapshot.depth_mm(),
                snapshot.result.seconds["total"],
                difference(look.rgb, pixels),
            )

    def update(self, change: Change) -> None:
        """Let later looks follow an edit of the scene's arrays in place."""
        # what no look has needed yet is made of the arrays as they are then
        if "_view" in self.__dict__:
            self._view.apply([change])
        if "_tracer" in self.__dict__:
            self._tracer.update(change)

    def splat_actor(self) -> "SplatActor":
        """Return the head as splats for a VTK or pyvista scene.

        Show it with ``actor.show_in(plotter.renderer)``, which keeps splats in order.
        """
        from renderers.fsr import SplatActor, extract_fuzzy_set

        return SplatActor(extract_fuzzy_set(self.scene), self.scene)

    @cached_property
    def _view(self) -> "EndoscopeView":
        from paravol.session_setup import LIVE_TIER, SEED
        from paravol.view import EndoscopeView
        from renderers.shading import Tier

        return EndoscopeView(
            self,
            ring_radius_mm=Endoscope().ring_radius_mm,
            has_instrument=True,
            tier=Tier[LIVE_TIER],
            seed=SEED,
            threads=thread_count(),
            visible_sets=False,
        )

    @cached_property
    def _tracer(self) -> "ActiveRayTracer":
        from renderers.art import ActiveRayTracer

        return ActiveRayTracer(self.scene, threads=thread_count())


def thread_count() -> int:
    """Return the number of processors that this process may use."""
    return usable_cores()


@cache
def instrument(name: str = FIRST_TOOL, jaw: float = 1.0) -> Mesh:
    """Return an instrument's triangles, mm; +z of its frame runs back up the shaft.

    jaw: 0 open to 1 closed. UserError names the instruments there are.
    """
    return instrument_named(name).mesh(jaw)


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
            head.seed,
            head.spacing_mm,
            progress,
            variants=head.variants,
            polyps=(head.polyps_right, head.polyps_left),
            disease=head.disease,
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
    surface = decongest(patient.surface, structures.labels)
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
) -> PatientScene:
    """Return a virtual patient, from the user's cache or built in about a minute.

    seed: decides the anatomy; 1 is the patient of the bundled flight. spacing_mm: of
    the voxels. progress: called with what is being done and the share, 0 to 1.
    variants: of its anatomy, as ``"onodi:left"`` or ``"concha-bullosa"``. polyps: their
    grades 0 to 4, right and left. disease: what else fills sinuses and what surgery
    left, as ``"fluid:maxillary:left=0.4"``, see `anatomy.phantom.variants`. UserError
    for an unknown variant or word.
    """
    right, left = polyps
    opacity = Opacity(polyps=right), Opacity(polyps=left)
    parameters = with_variants(PhantomParameters(seed=seed, opacity=opacity), variants)
    parameters = with_findings(parameters, disease)
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
    return PatientScene(
        scene,
        landmarks,
        surface_hash(surface),
        way_in,
        others,
        Structures.of(surface.distance, case.labels, label_names, landmarks),
        None if skin is None else lambda: skin,
        case.layers,
        case.hazards,
    )


def surface_hash(surface: AirSurface) -> str:
    """Hash the distance values, their grid, the tint: all that a picture depends on."""
    digest = hashlib.sha256()
    for volume in (surface.distance, surface.blood, surface.skin):
        digest.update(repr(volume.shape).encode())
        digest.update(volume.world_from_voxel.tobytes())
        digest.update(volume.values.tobytes())
    return digest.hexdigest()
