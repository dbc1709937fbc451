"""The metrics of a recorded session."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import FARTHEST_MM
from devices.microscribe.kinematics.arm_errors import ArmErrors
from devices.microscribe.kinematics.inverse import UnreachableError
from devices.microscribe.kinematics.profiles import profile_named
from devices.microscribe.kinematics.uncertainty import EXACT
from devices.registration.target_error import fitzpatrick_rms_mm
from paravol.patient import PatientScene, Progress, StrPath, load_patient, no_progress
from paravol.scoring.shortest_way import inside_of, shortest_way_mm
from paravol.sessions.recorded_flight import (
    check_recorded,
    cut_again,
    edits_of,
    kept_edits,
    require_as_flown,
    why_stepped,
)
from paravol.sessions.session_replay import recorded_score
from paravol.sessions.session_setup import (
    coverage_watch,
    flown_scenario,
    reopen_session,
)
from paravol.sessions.session_timeline import SessionTimeline
from renderers.scene import Volume
from scenarios import Sample, Scenario, Score, Session
from scenarios.bundle import (
    EditRecord,
    Recording,
    SessionInfo,
    read_recording,
)
from scenarios.hazard_watch import ALWAYS_NEAR
from scenarios.metrics import (
    DEFINITIONS,
    Breach,
    Contacts,
    Definition,
    HazardGaps,
    Measured,
    Metric,
    PoseNoise,
    Reference,
    SessionNoise,
    Settings,
    Taken,
    Track,
    measure,
    recorded_noise,
    scope_changes,
    scope_track,
    tool_track,
    tool_use,
)
from scenarios.metrics.cavity import CAVITY, Cavity
from scenarios.metrics.metric import Interval
from scenarios.reading import Reading
from scenarios.sample_columns import SampleColumns
from surgery.patient import OperatedPatient
from system import UserError

_RECORD = "the record itself"

PatientSource = Callable[[Scenario], PatientScene]
"""Who loads the head that a scenario is flown through."""

_MOST_POSES = 40
"""Poses at which an arm's rounding is computed: it changes little over a nose."""


@dataclass(frozen=True, slots=True)
class SessionMetrics:
    """A session's metrics and what they were computed with.

    is_complete: False where the recording ends in the middle. noise: of the poses.
    settings: thresholds and filters. measured: what they were computed from. span:
    seconds of the first and the last sample. scenario: that was flown. score: the
    session's; None where its head was left out.
    source: "recorded" where the recording was checked and trusted, else "stepped" and
    why; "" where the head was left out. frozen: seconds in which the score's clock
    stood.
    """

    metrics: list[Metric]
    is_complete: bool
    noise: SessionNoise
    settings: Settings
    measured: Measured
    span: Interval = (0.0, 0.0)
    scenario: Scenario | None = None
    score: Score | None = None
    source: str = ""
    frozen: tuple[Interval, ...] = ()


Chosen = tuple[Definition, ...] | Callable[[Scenario], tuple[Definition, ...]]
"""Which metrics are wanted: the same always, or what an exercise needs."""

Watch = Callable[[Session, Sample], None]
"""Told of every sample after the session has taken it in."""


def session_metrics(
    folder: StrPath,
    *,
    settings: Settings | None = None,
    chosen: Chosen = DEFINITIONS,
    arm: str = "",
    case: Path | None = None,
    has_head: bool = True,
    expert: Path | Track | None = None,
    progress: Progress = no_progress,
    patient: PatientScene | PatientSource | None = None,
    exact: bool = False,
    watch: Watch | None = None,
    timeline: SessionTimeline | None = None,
) -> SessionMetrics:
    """Compute the metrics of a recorded session.

    settings: None for the usual ones. arm: profile of the arm that was used, for the
    rounding of its joints; "" estimates the noise from the record. case: where the case
    that was flown through lies now. has_head: step the session through its head again;
    without that contact, hazards and removal are not known. expert: a session of the
    same head, or a scope's track through it, that is compared with. patient: the one
    that was flown through, where it is loaded already, or who loads it. exact: step
    it though its recording says all, see `paravol.sessions.recorded_flight`; the same
    comes of both. watch: looks on while the session is stepped. timeline: of this
    session, before its first sample, that is stepped to its end. UserError when the
    session cannot be read, holds no sample, was changed, or was flown through another
    head.
    """
    folder = Path(folder)
    recording = read_recording(folder)
    samples = SampleColumns.of(recording.samples)
    if not len(samples):
        raise UserError(f"{folder} holds no sample; nothing was recorded.")
    require_as_flown(folder, recording)
    scenario = recording.info.exercise()
    if callable(chosen):
        chosen = chosen(scenario)
    settings = Settings() if settings is None else settings
    world_from_device = np.array(recording.info.world_from_device).reshape(4, 4)
    measured = _measured(samples, recording, settings, world_from_device)
    if expert is not None:
        track = expert
        if not isinstance(track, Track):
            track = _expert(track, recording.info)
        measured = replace(measured, expert=track)
    score, source = None, ""
    if has_head:
        flown = flown_scenario(folder, recording.info, case)
        if patient is None:
            patient = load_patient(flown, progress)
        elif not isinstance(patient, PatientScene):
            patient = patient(flown)
        measured, score, source = _through_head(
            _Flown(folder, recording, samples, patient, chosen, exact, watch, timeline),
            measured,
            progress,
        )
        if isinstance(expert, Path) and _wants_cavity(chosen):
            other = session_metrics(expert, chosen=CAVITY, case=case, patient=patient)
            measured = replace(measured, expert_cavity=other.measured.cavity)
    noise = session_noise(measured, samples, recording.info, scenario, arm)
    progress("Metrics", 0.0)
    metrics = measure(measured, noise, chosen)
    progress("Metrics", 1.0)
    times = samples.time_s
    stands = np.flatnonzero(samples.is_frozen[:-1] | samples.is_frozen[1:])
    frozen = tuple((float(times[n]), float(times[n + 1])) for n in stands)
    return SessionMetrics(
        metrics,
        recording.complete,
        noise,
        settings,
        measured,
        (float(times[0]), float(times[-1])),
        scenario,
        score,
        source,
        frozen,
    )


def session_noise(
    measured: Measured,
    samples: SampleColumns,
    info: SessionInfo,
    scenario: Scenario,
    arm: str,
) -> SessionNoise:
    """Return how far a session's poses are wrong.

    The tip's noise is an arm's rounding to counts, at the poses that it had, or what
    the record shows. The registration's error is expected at the middle of the way: it
    comes of the residual, which by itself says nothing about a target (Fitzpatrick,
    West, Maurer, IEEE Trans. Med. Imaging 17, 1998).
    """
    gap_s = measured.settings.gap_s
    tip_mm, turn_rad = recorded_noise(measured.scope, gap_s)
    # the second channel's poses are recorded in the patient's frame already
    tool = PoseNoise.even(*recorded_noise(measured.tool, gap_s), 0.0, _RECORD)
    offset_mm = 0.0
    touched = np.array([f.position_mm for f in scenario.fiducials]).reshape(-1, 3)
    places = measured.scope.valid
    if len(touched) > 2 and len(places):
        count = len(touched)
        at_each_mm = info.registration_rms_mm * np.sqrt(count / (count - 2))
        middle = measured.scope.tip_mm[places].mean(axis=0)
        rms_mm = fitzpatrick_rms_mm(touched, middle[None], float(at_each_mm))
        offset_mm = float(rms_mm[0] / np.sqrt(3.0))
    if not arm:
        scope = PoseNoise.even(tip_mm, turn_rad, offset_mm, _RECORD)
        return SessionNoise(scope, tool)
    profile = profile_named(arm)
    chosen = places[:: max(len(places) // _MOST_POSES, 1)]
    frames = samples.device_from_tip[chosen]
    world_from_device = np.array(info.world_from_device).reshape(4, 4)
    nothing = np.zeros((3, 3))
    errors = ArmErrors(profile.geometry, profile.encoders, EXACT, np.zeros(3), nothing)
    try:
        at = errors.at(frames.reshape(-1, 4, 4), world_from_device, nothing)
    except UnreachableError as error:
        raise UserError(
            f"An arm of the profile {arm!r} cannot have had the poses of this session; "
            "name the one that was used with --arm."
        ) from error
    covariance = at.noise.mean(axis=0) if len(at.noise) else nothing
    scope = PoseNoise(covariance, turn_rad, offset_mm, f"counts of the arm {arm}")
    return SessionNoise(scope, tool)


def _measured(
    samples: SampleColumns,
    recording: Recording,
    settings: Settings,
    world_from_device: NDArray[np.float64],
) -> Measured:
    """Return what is known without a head."""
    scenario = recording.info.exercise()
    scope = scenario.scope.endoscope()
    return Measured(
        scope_track(samples, world_from_device),
        tool_track(samples),
        scope,
        scope_changes=scope_changes(samples, scope.angle_deg),
        tool_use=tool_use(samples),
        allowed_tools=scenario.tools,
        picture_px=recording.info.picture_size[0],
        settings=settings,
    )


class _Flown(NamedTuple):
    """A recording and the head it was flown through.

    chosen: the metrics that are wanted. exact, watch, timeline: see `session_metrics`.
    """

    folder: Path
    recording: Recording
    samples: SampleColumns
    patient: PatientScene
    chosen: tuple[Definition, ...]
    exact: bool
    watch: Watch | None
    timeline: SessionTimeline | None

    def session(self) -> tuple[Session, Iterator[Sample]]:
        """Return a session at its begin, and the samples as it takes them in."""
        if self.timeline is not None:
            return self.timeline.session, self.timeline.walk()
        _, session = reopen_session(self.folder, self.recording.info, self.patient)

        def steps() -> Iterator[Sample]:
            for record in self.recording.samples:
                sample = record.sample()
                session.step(sample)
                yield sample

        return session, steps()

    def wants(self, name: str) -> bool:
        """Return whether a metric of this name is wanted."""
        return any(definition.name == name for definition in self.chosen)


def _through_head(
    flown: _Flown, measured: Measured, progress: Progress
) -> tuple[Measured, Score, str]:
    """Add what the session's head shows; return also the score and its source."""
    scenario = flown.recording.info.exercise()
    targets = flown.patient.positions(scenario.targets)
    reference = None
    if flown.wants("economy of motion"):
        distance = flown.patient.surface.distance
        reference = _reference(measured, distance, targets)
    measured = replace(measured, targets=targets, reference=reference)
    score, why = None, "asked for"
    if not flown.exact and flown.watch is None and flown.timeline is None:
        score = recorded_score(flown.folder)
        why = why_stepped(flown.folder, flown.recording, score)
    wants_cavity = _wants_cavity(flown.chosen)
    mucosa = cavity = None
    if score is not None and not why:
        if flown.patient.surface_sha256 != flown.recording.info.surface_sha256:
            # says what is wrong
            reopen_session(flown.folder, flown.recording.info, flown.patient)
        check_recorded(flown.folder, flown.recording, score)
        readings = [s.reading for s in flown.recording.samples if s.reading]
        edits = edits_of(flown.recording)
        if flown.wants("touched area"):
            mucosa = coverage_watch(flown.patient).mucosa
        if wants_cavity and edits:
            cavity = _cavity(cut_again(flown.recording, flown.patient))
        source = "recorded"
    else:
        session, readings, edits = _stepped(flown, progress)
        score, source = session.score(), f"stepped: {why}"
        mucosa = None if session.coverage is None else session.coverage.mucosa
        if wants_cavity and session.operation is not None:
            cavity = _cavity(session.operation.patient)
    measured = replace(
        _with_readings(measured, readings, flown),
        mucosa=mucosa,
        cavity=cavity,
        coverage=score.coverage,
    )
    if score.operation is not None:
        breaches = tuple(
            Breach(f.time_s, f.structure, f.by, f.depth_mm)
            for f in score.operation.injuries
        )
        taken = tuple(Taken(e.time_s, e.tool, e.taken_mm3) for e in edits)
        measured = replace(measured, edits=taken, breaches=breaches)
    return measured, score, source


def _with_readings(
    measured: Measured, readings: Sequence[Reading], flown: _Flown
) -> Measured:
    """Add what was measured at each sample."""
    times = flown.samples.time_s
    names = tuple(dict.fromkeys(r.touched for r in readings if r.touched))
    codes = {"": -1} | {name: code for code, name in enumerate(names)}
    contacts = Contacts(
        times,
        np.array([r.gap_mm for r in readings]),
        np.array([codes[r.touched] for r in readings], np.int64),
        names,
    )
    farthest_mm = FARTHEST_MM - measured.endoscope.diameter_mm / 2
    tool = None
    if flown.samples.is_held.any():
        tool = _gaps(times, [r.tool_hazards_mm for r in readings], FARTHEST_MM)
    return replace(
        measured,
        contacts=contacts,
        hazards=_gaps(times, [r.hazards_mm for r in readings], farthest_mm),
        tool_hazards=tool,
    )


def _stepped(
    flown: _Flown, progress: Progress
) -> tuple[Session, list[Reading], list[EditRecord]]:
    """Step the session through its head; return also what that measured and cut."""
    count = len(flown.samples)
    session, samples = flown.session()
    readings, edits, undone = list[Reading](), list[EditRecord](), list[float]()
    for place, sample in enumerate(samples):
        reading = session.reading
        assert reading is not None
        readings.append(reading)
        if session.operation is not None:
            edits += [EditRecord.of(edit) for edit in session.operation.take_edits()]
            undone += [sample.time_s] * (sample.instrument.undone - len(undone))
            session.operation.take_changes()
            session.operation.take_injuries()
        if flown.watch is not None:
            flown.watch(session, sample)
        progress("Stepping the session", (place + 1) / count)
    return session, readings, kept_edits(edits, undone)


def _wants_cavity(chosen: tuple[Definition, ...]) -> bool:
    names = {definition.name for definition in CAVITY}
    return any(definition.name in names for definition in chosen)


def _cavity(patient: OperatedPatient) -> Cavity:
    return Cavity.between(patient.pristine.distance, patient.surface.distance)


def _expert(folder: Path, info: SessionInfo) -> Track:
    """Return the scope's track of another session; UserError for another head."""
    recording = read_recording(folder)
    if recording.info.surface_sha256 != info.surface_sha256:
        raise UserError(
            f"{folder} was flown through another head: its path cannot be compared."
        )
    samples = SampleColumns.of(recording.samples)
    return scope_track(
        samples, np.array(recording.info.world_from_device).reshape(4, 4)
    )


def _gaps(
    times: NDArray[np.float64],
    rows: Sequence[dict[str, float] | None],
    farthest_mm: float,
) -> HazardGaps | None:
    """Return the gaps by hazard, without what every scope glides along."""
    named = dict.fromkeys(name for row in rows if row is not None for name in row)
    gaps = {
        name: np.array([np.nan if row is None else row[name] for row in rows])
        for name in named
        if name not in ALWAYS_NEAR
    }
    return HazardGaps(times, gaps, farthest_mm) if gaps else None


def _reference(
    measured: Measured,
    distance: Volume,
    targets: dict[str, NDArray[np.float64]],
) -> Reference | None:
    """Return the shortest way by the targets, in the order in which they were met."""
    track = measured.scope
    places = track.valid
    if len(places) == 0:
        return None
    inside = places[inside_of(distance, track.tip_mm[places])]
    if len(inside) < 2:
        return None
    tips = track.tip_mm[inside]
    met = sorted(
        int(np.argmin(np.linalg.norm(tips - at, axis=1))) for at in targets.values()
    )
    ways = [0, *met, len(inside) - 1]
    length_mm = shortest_way_mm(
        distance, tips[ways], measured.endoscope.diameter_mm / 2
    )
    if length_mm is None:
        return None
    begin_s, end_s = track.time_s[inside[0]], track.time_s[inside[-1]]
    return Reference(length_mm, float(begin_s), float(end_s))
