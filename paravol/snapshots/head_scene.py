"""A head ready to be pictured, and what a view of it asks the ray tracer for."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from paravol.patient import (
    Progress,
    decongested,
    load_case,
    load_phantom,
    load_scene,
)
from paravol.snapshots.operated_head import OperatedHead
from paravol.snapshots.view_file import (
    CaseHead,
    Head,
    PhantomHead,
    PlacedInstrument,
    ScanHead,
    SceneHead,
    ScopeLook,
    ViewFile,
)
from renderers.art.quality import ClassificationName
from renderers.scene import Scene
from renderers.scene.mesh import PlacedMesh
from renderers.snapshots.client import RequestOptions, SnapshotClient
from renderers.snapshots.request import (
    PathTracingSpec,
    QualityName,
    Samples,
    SnapshotRequest,
)
from scenarios.instruments import placed_tool
from system import UserError


@dataclass(frozen=True, slots=True)
class RenderSettings:
    """Set how finely a picture is drawn, and how long it may take.

    seconds: the best picture so far is taken then. tolerance: as in
    `SnapshotRequest`.
    """

    quality: QualityName = "snapshot"
    samples: Samples = 4
    path_tracing: PathTracingSpec | None = None
    seconds: float | None = None
    classification: ClassificationName = "integrated"
    tolerance: float | None = None


@dataclass(frozen=True, slots=True)
class HeadScene:
    """One head's scene.

    scene, surface_sha256: of the head before any operation; the hash is "" where it has
    no surface. operated: as it was at moments of an operation, by their digests.
    """

    scene: Scene
    surface_sha256: str
    operated: Mapping[str, OperatedHead] = field(default_factory=dict)

    @classmethod
    def of(cls, head: Head, progress: Progress) -> "HeadScene":
        """Build, read or import a head; UserError for one that cannot be had."""
        if isinstance(head, ScanHead):
            return cls(_scan_scene(Path(head.file), progress), "")
        if isinstance(head, CaseHead):
            if not Path(head.folder).is_dir():
                raise UserError(
                    f"The view is of the case {head.folder}, which is not there; say "
                    "with --case where it lies now."
                )
            patient = load_case(Path(head.folder), progress)
        elif isinstance(head, SceneHead):
            patient = load_scene(head.name, head.seed, head.spacing_mm, progress)
        else:
            assert isinstance(head, PhantomHead)
            patient = load_phantom(
                head.seed,
                head.spacing_mm,
                progress,
                variants=head.variants,
                polyps=(head.polyps_right, head.polyps_left),
                disease=head.disease,
                average=not head.drawn,
            )
        if isinstance(head, CaseHead | PhantomHead) and head.decongested:
            patient = decongested(patient)
        return cls(patient.scene, patient.surface_sha256)

    def demand(self, view: ViewFile) -> None:
        """Raise UserError where the view is of another head, or cannot be drawn."""
        wanted = view.surface_sha256
        if wanted is not None and wanted != self.surface_sha256:
            found = self.surface_sha256[:12] or "none"
            raise UserError(
                f"The view is of another head (surface {wanted[:12]}, now {found}); "
                "name the case it was taken in with --case."
            )
        mark = view.operated
        if mark is not None and mark.digest not in self.operated:
            recording = mark.recording or "RECORDING"
            raise UserError(
                "The view is of a head that was operated on, and a view file does not "
                f"hold the cuts (state {mark.digest[:12]}); draw it from the recording "
                f"of the flight: paravol snapshot {recording} --time {mark.time_s!r}."
            )
        if self.scene.surface is None and isinstance(view.look, ScopeLook):
            raise UserError(
                "A scan has no surface that an endoscope could see; make a case of it "
                "with paravol import, or look at it in mode classic."
            )
        lens = view.camera.projection
        if isinstance(view.look, ScopeLook) and lens != "equidistant":
            raise UserError(
                f"An endoscope's lens is equidistant, got {lens}; draw this view in "
                "mode classic."
            )

    def seen(self, view: ViewFile) -> Scene:
        """Return the scene that a view shows: operated on, where it is."""
        self.demand(view)
        tissue = self._tissue(view)
        return self.scene if tissue is None else tissue.scene(self.scene)

    def _tissue(self, view: ViewFile) -> OperatedHead | None:
        return None if view.operated is None else self.operated[view.operated.digest]

    def request(
        self, client: SnapshotClient, view: ViewFile, settings: RenderSettings
    ) -> SnapshotRequest:
        """Make the request for a picture of a view."""
        self.demand(view)
        camera, look = view.to_camera(), view.look
        options = RequestOptions(
            quality=settings.quality,
            deflectors=view.deflectors,
            max_seconds=LONGEST_S,
            progressive=True,
            deliver_after_s=settings.seconds,
        )
        instruments, tissue = placed(view.instruments), self._tissue(view)
        if not isinstance(look, ScopeLook):
            options["classification"] = settings.classification
            return client.request_classic(
                self.scene,
                camera,
                samples=settings.samples,
                instruments=instruments,
                changes=None if tissue is None else tissue.ct,
                **options,
            )
        assert self.scene.surface is not None
        options["tolerance"] = settings.tolerance
        return client.request_scope(
            self.scene.surface if tissue is None else tissue.surface,
            camera,
            samples=settings.samples,
            instruments=instruments,
            path_tracing=settings.path_tracing,
            ring_radius_mm=look.ring_radius_mm,
            light_power=look.light_power,
            seed=look.seed,
            blood_bias=look.blood_bias,
            gain=look.gain,
            frame_number=look.frame_number,
            **options,
        ).through(look.lens)


LONGEST_S = 86_400.0
"""A picture that takes a day is given up."""


def placed(instruments: tuple[PlacedInstrument, ...]) -> list[PlacedMesh]:
    """Return the meshes of instruments' parts with their 4x4 poses."""
    last = np.array([[0.0, 0.0, 0.0, 1.0]])
    found = []
    for each in instruments:
        pose = np.vstack([np.array(each.world_from_instrument), last])
        found += placed_tool(each.name, pose, each.jaw)
    return found


def _scan_scene(file: Path, progress: Progress) -> Scene:
    from anatomy.scan.histogram import find_peaks, transfer_of
    from anatomy.scan.scan import Modality, read_scan

    scan = read_scan(file, progress=progress)
    peaks = find_peaks(scan.volume, bone=scan.modality is Modality.CT)
    return Scene(scan.volume, transfer_of(peaks))
