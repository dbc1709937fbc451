"""Where views come from: a moment of a session or an exercise, or a place given."""

import math
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from paravol.exercises.case_scenario import scenario_of_case
from paravol.exercises.exercise_path import recorded_path
from paravol.patient import PatientScene, Progress, load_patient
from paravol.sessions.session_setup import flown_scenario, path_view
from paravol.sessions.session_timeline import GRACE_S, SessionTimeline
from paravol.snapshots.head_scene import HeadScene
from paravol.snapshots.operated_head import OperatedHead
from paravol.snapshots.view_file import (
    CaseHead,
    ClassicLook,
    Head,
    OperatedMark,
    PhantomHead,
    PlacedInstrument,
    SceneHead,
    ScopeLook,
    ViewCamera,
    ViewFile,
)
from renderers.scene.lens_state import CLEAN, LensState
from renderers.snapshots.request import ProjectionName, Row
from scenarios import FrameState, Sample, Scenario, load_scenario
from scenarios.bundle import FrameRecord, SampleRecord, read_recording
from scenarios.instrument_state import NO_TOOL
from system import UserError

FIELD_DEG = 70.0
"""Of a view that is placed by hand."""

Place = tuple[float, float, float]


def session_views(
    folder: Path,
    times_s: NDArray[np.float64],
    size: int | None,
    case: Path | None,
    progress: Progress,
) -> tuple[HeadScene, list[ViewFile]]:
    """Return what a session saw at each time, with the camera's gain of then.

    The newest sample at or before a time counts, before the first one the first. size:
    edge of the pictures, pixels; None for that of the frame that was shown then. case:
    where the case that was flown through lies now. Raises UserError for a session that
    cannot be read or was flown through another head, or for a time after its end.
    """
    recording = read_recording(folder)
    info = recording.info
    samples: list[tuple[Sample, float | None, int]] = []
    gain, number = None, 0
    sizes: dict[int, tuple[int, int]] = {}
    for record in recording.records:
        if isinstance(record, SampleRecord):
            samples.append((record.sample(), gain, number))
        elif isinstance(record, FrameRecord):
            gain, number = record.gain, record.number
            sizes[number] = record.size_of(info.picture_size)
            if samples:
                samples[-1] = samples[-1][0], gain, number
    if not samples:
        raise UserError(f"{folder} holds no sample; nothing was recorded.")
    scenario = flown_scenario(folder, info, case)
    patient = load_patient(scenario, progress)
    if patient.surface_sha256 != info.surface_sha256:
        raise UserError(
            f"{folder} was flown through another head (surface "
            f"{info.surface_sha256[:12]}, now {patient.surface_sha256[:12]}); name the "
            "case it was flown through with --case."
        )
    timeline = SessionTimeline(folder, patient, recording)
    operation = timeline.session.operation
    begins = np.array([sample.time_s for sample, _, _ in samples])
    _require_within(times_s, float(begins[-1]), folder)
    chosen = np.maximum(np.searchsorted(begins, times_s, side="right") - 1, 0)
    views: list[ViewFile | None] = [None] * len(chosen)
    states: dict[str, OperatedHead] = {}
    for place in np.argsort(chosen, kind="stable").tolist():
        sample, gain, number = samples[chosen[place]]
        tissue, lens = None, CLEAN
        if operation is not None:
            # a frame shows the head as the samples up to its own had left it
            sample, _ = timeline.go_to(sample.time_s)
            tissue = OperatedHead.of(operation.patient, operation.pushing)
            states[tissue.digest] = tissue
            assert operation.lens is not None
            lens = operation.lens.state
        views[place] = view_of(
            timeline.session.view(sample, (size, size) if size else sizes.get(number)),
            scenario,
            timeline.patient,
            gain=gain,
            number=number,
            operated=mark_of(tissue, folder, sample.time_s),
            seed=info.seed,
            has_instrument=info.has_instrument or info.operated,
            lens=lens,
        )
    seen = HeadScene(patient.scene, patient.surface_sha256, states)
    return seen, [view for view in views if view is not None]


def case_views(
    folder: Path, times_s: NDArray[np.float64], size: int, progress: Progress
) -> tuple[HeadScene, list[ViewFile]]:
    """Return what a scope sees along a case's exercise; UserError after its end."""
    scenario, place = load_scenario(str(scenario_of_case(folder)))
    patient = load_patient(scenario, progress)
    path = recorded_path(scenario, place)
    _require_within(times_s, path.duration_s, folder)
    views = [
        view_of(
            path_view(scenario, patient, path, float(t), (size, size)),
            scenario,
            patient,
        )
        for t in times_s
    ]
    return HeadScene(patient.scene, patient.surface_sha256), views


def _require_within(times_s: NDArray[np.float64], end_s: float, folder: Path) -> None:
    """Raise UserError for a moment after the last one."""
    late = float(times_s.max())
    if late > end_s + GRACE_S:
        raise UserError(
            f"{folder} ends after {end_s:.1f} s and has nothing at {late:g} s; name an "
            "earlier time."
        )


def placed_view(
    head: Head,
    eye: Place,
    target: Place,
    *,
    up: Place,
    size: int,
    lens: ProjectionName,
    half_side_mm: float,
    distortion: tuple[float, float] = (0.0, 0.0),
    classic: bool,
) -> ViewFile:
    """Return the view from a place to a place; UserError where one cannot look so."""
    extent = math.radians(FIELD_DEG / 2)
    detail = head.seed if isinstance(head, PhantomHead) else 1
    if lens == "orthographic":
        extent = half_side_mm
    view = ViewFile(
        schema="paravol.view/1",
        head=head,
        camera=ViewCamera(
            eye,
            extent,
            target_mm=target,
            up=up,
            projection=lens,
            distortion=distortion,
        ),
        size_px=(size, size),
        look=ClassicLook() if classic else ScopeLook(1.45, seed=detail),
    )
    camera = ViewCamera.of(view.to_camera())
    return msgspec.structs.replace(view, camera=camera)


def view_of(
    view: FrameState,
    scenario: Scenario,
    patient: PatientScene,
    *,
    gain: float | None = None,
    number: int = 0,
    operated: OperatedMark | None = None,
    seed: int | None = None,
    has_instrument: bool = False,
    lens: LensState = CLEAN,
) -> ViewFile:
    """Describe a view of a session, so that it can be saved and drawn later."""
    flown = scenario.head
    head: Head = PhantomHead(
        flown.number,
        flown.spacing_mm,
        flown.variants,
        flown.polyps_right,
        flown.polyps_left,
        flown.decongested,
        flown.disease,
        bool(flown.patients),
    )
    if flown.case:
        head = CaseHead(str(Path(flown.case).resolve()), flown.decongested)
    elif flown.scene:
        head = SceneHead(flown.scene, flown.seed, flown.spacing_mm)
    tools: tuple[PlacedInstrument, ...] = ()
    if has_instrument and view.instrument != NO_TOOL:
        rows = msgspec.convert(
            view.world_from_instrument[:3].tolist(), tuple[Row, Row, Row]
        )
        jaw = min(max(view.jaw, 0.0), 1.0)
        tools = (PlacedInstrument(view.instrument, rows, jaw),)
    return ViewFile(
        schema="paravol.view/1",
        head=head,
        camera=ViewCamera.of(view.camera),
        size_px=(view.camera.width, view.camera.height),
        look=ScopeLook(
            scenario.scope.ring_radius_mm,
            seed=patient.detail_seed if seed is None else seed,
            gain=gain,
            frame_number=number,
        ).through(lens),
        instruments=tools,
        surface_sha256=patient.surface_sha256,
        operated=operated,
    )


def mark_of(
    tissue: OperatedHead | None, recording: Path | None, time_s: float
) -> OperatedMark | None:
    """Describe what a view shows of an operated head; None where nothing was cut."""
    if tissue is None or not tissue.digest:
        return None
    folder = "" if recording is None else str(recording.resolve())
    return OperatedMark(tissue.digest, folder, max(time_s, 0.0))
