"""The metrics of a recorded session."""

from collections.abc import Callable, Iterator, Mapping, Sequence
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
from disk import UserError
from paravol.patient import PatientScene, Progress, StrPath, load_patient, no_progress
from paravol.recorded_cavity import cavity_of, recorded_cavity
from paravol.recorded_gaps import (
    Poses,
    check_recorded,
    demand_as_flown,
    recorded_gaps,
    why_untrusted,
)
from paravol.session_replay import recorded_score
from paravol.session_setup import coverage_watch, flown_scenario, reopen_session
from paravol.session_timeline import SessionTimeline
from paravol.shortest_way import inside_of, shortest_way_mm
from renderers.scene import Volume
from scenarios import Sample, Scenario, Score, Session
from scenarios.bundle import (
    EditRecord,
    Recording,
    SampleRecord,
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
from scenarios.metrics.cavity import CAVITY
from scenarios.metrics.metric import Interval
from scenarios.sample_columns import SampleColumns
from surgery.edit import Edit

_RECORD = "the record itself"

PatientSource = Callable[[Scenario], PatientScene]
"""Who loads the head that a scenario is flown through."""

_MOST_POSES = 40
"""Poses at which an arm's rounding is computed: it changes little over a nose."""


@dataclass(frozen=True, slots=True)
class SessionMetrics:
    """Hold a session's metrics and what they were computed with.

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
    trusts: bool = False,
    watch: Watch | None = None,
    timeline: SessionTimeline | None = None,
) -> SessionMetrics:
    """Compute the metrics of a recorded session.

    settings: None for the usual ones. arm: profile of the arm that was used, for the
    rounding of its joints; "" estimates the noise from the record. case: where the case
    that was flown through lies now. has_head: step the session through its head again;
    without that contact, hazards and removal are not known. expert: a session of the
    same head, or a scope's track through it, that is compared with. patient: the one
    that was flown through, where it is loaded already, or who loads it. trusts: do not
    step a session whose recording can be checked otherwise, see
    `paravol.recorded_gaps`; some hundred times faster, and equal but for rounding.
    watch: looks on while the session is stepped. timeline: of this session, before its
    first sample, that is stepped to its end instead of another one. UserError when the
    session cannot be read, holds no sample, was changed, or was flown through another
    head.
    """
    folder = Path(folder)
    recording = read_recording(folder)
    samples = SampleColumns.of(_sample_records(recording))
    if not len(samples):
        raise UserError(f"{folder} holds no sample; nothing was recorded.")
    demand_as_flown(folder, recording)
    scenario = _scenario(recording.info)
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
            _Flown(
                folder, recording, samples, patient, chosen, trusts, watch, timeline
            ),
            measured,
            progress,
        )
        if isinstance(expert, Path) and _wants_cavity(chosen):
            other = recorded_cavity(expert, patient)
            measured = replace(measured, expert_cavity=other)
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


def _sample_records(recording: Recording) -> list[SampleRecord]:
    return [r for r in recording.records if isinstance(r, SampleRecord)]


def _scenario(info: SessionInfo) -> Scenario:
    return info.exercise()


def _measured(
    samples: SampleColumns,
    recording: Recording,
    settings: Settings,
    world_from_device: NDArray[np.float64],
) -> Measured:
    """Return what is known without a head."""
    scenario = _scenario(recording.info)
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


class _Steps:
    """Gather what each sample of a stepped session meant."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.gaps: list[float] = []
        self.touched: list[str] = []
        self.scope: list[dict[str, float]] = []
        self.tool: list[dict[str, float] | None] = []
        self.edits: list[Edit] = []
        self._undone = 0

    def add(self, sample: Sample) -> None:
        """Read the session after it has taken in a sample."""
        placed = self._session.placed
        assert placed is not None
        self.gaps.append(placed.gap_mm)
        self.touched.append(placed.touched)
        if placed.hazards is not None:
            self.scope.append(placed.hazards.shaft)
            self.tool.append(placed.hazards.instrument)
        operation = self._session.operation
        if operation is None:
            return
        new = operation.take_edits()
        if sample.instrument.undone > self._undone:
            self._undone = sample.instrument.undone
            # a sample's undoing comes before what it cuts
            before = operation.patient.books.counts - sum(e.counts for e in new)
            self._take_back(before)
        self.edits += new
        operation.take_changes()
        operation.take_injuries()

    def _take_back(self, counts: int) -> None:
        """Leave out the newest strokes, until no more is taken than the books have."""
        while sum(edit.counts for edit in self.edits) > counts:
            stroke = self.edits[-1].stroke
            while self.edits and self.edits[-1].stroke == stroke:
                self.edits.pop()


class _Flown(NamedTuple):
    """Hold a recording and the head it was flown through.

    chosen: the metrics that are wanted. trusts, watch, timeline: see `session_metrics`.
    """

    folder: Path
    recording: Recording
    samples: SampleColumns
    patient: PatientScene
    chosen: tuple[Definition, ...]
    trusts: bool
    watch: Watch | None
    timeline: SessionTimeline | None

    def session(self) -> tuple[Session, Iterator[Sample]]:
        """Return a session at its begin, and the samples as it takes them in."""
        if self.timeline is not None:
            return self.timeline.session, self.timeline.walk()
        _, session = reopen_session(self.folder, self.recording.info, self.patient)

        def steps() -> Iterator[Sample]:
            for record in _sample_records(self.recording):
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
    scenario = _scenario(flown.recording.info)
    targets = flown.patient.positions(scenario.targets)
    reference = None
    if flown.wants("economy of motion"):
        distance = flown.patient.surface.distance
        reference = _reference(measured, distance, targets)
    measured = replace(measured, targets=targets, reference=reference)
    why = "asked for"
    if flown.trusts:
        score = recorded_score(flown.folder)
        why = why_untrusted(
            flown.recording,
            score,
            has_frozen=bool(flown.samples.is_frozen.any()),
            undone=flown.samples.undone,
        )
        if score is not None and not why:
            return _as_recorded(flown, measured, score), score, "recorded"
    measured, score = _stepped(flown, measured, progress)
    return measured, score, f"stepped: {why}"


def _as_recorded(flown: _Flown, measured: Measured, score: Score) -> Measured:
    """Add what the recording says, checked; UserError where it contradicts itself."""
    info = flown.recording.info
    if flown.patient.surface_sha256 != info.surface_sha256:
        reopen_session(flown.folder, info, flown.patient)  # says what is wrong
    matrix = np.array(info.world_from_device).reshape(4, 4)
    samples = flown.samples
    times = samples.time_s
    back = np.flatnonzero(np.diff(times) < 0.0)
    if len(back):
        raise UserError(
            f"samples must be in order of time: {times[back[0] + 1]} after "
            f"{times[back[0]]}. Its clock ran backwards, or the stream was changed; "
            "--exact steps it all the same."
        )
    poses = Poses(
        times,
        matrix @ samples.device_from_tip,
        np.where(samples.is_held[:, None], samples.tool_mm, np.nan),
    )
    radius_mm = measured.endoscope.diameter_mm / 2
    gaps = recorded_gaps(
        flown.recording,
        flown.patient,
        poses,
        radius_mm,
        has_names=flown.wants("contact time on"),
    )
    check_recorded(flown.recording, score, gaps, poses, dict(measured.targets))
    mucosa = None
    if flown.wants("touched area"):
        mucosa = coverage_watch(flown.patient).mucosa
    measured = replace(
        measured,
        mucosa=mucosa,
        cavity=cavity_of(gaps.operated) if _wants_cavity(flown.chosen) else None,
        contacts=gaps.contacts,
        hazards=_named_gaps(times, gaps.hazards, FARTHEST_MM - radius_mm),
        tool_hazards=_named_gaps(times, gaps.tool_hazards, FARTHEST_MM)
        if samples.is_held.any()
        else None,
        coverage=score.coverage,
    )
    if score.operation is None:
        return measured
    edits = [r for r in flown.recording.records if isinstance(r, EditRecord)]
    return replace(
        measured,
        edits=tuple(Taken(e.time_s, e.tool, e.taken_mm3) for e in edits),
        breaches=_breaches(score),
    )


def _stepped(
    flown: _Flown, measured: Measured, progress: Progress
) -> tuple[Measured, Score]:
    """Step the session through its head; add what that shows."""
    times = flown.samples.time_s
    session, samples = flown.session()
    steps = _Steps(session)
    for place, sample in enumerate(samples):
        steps.add(sample)
        if flown.watch is not None:
            flown.watch(session, sample)
        progress("Stepping the session", (place + 1) / len(times))
    names = tuple(dict.fromkeys(name for name in steps.touched if name))
    codes = {"": -1} | {name: code for code, name in enumerate(names)}
    contacts = Contacts(
        times,
        np.array(steps.gaps),
        np.array([codes[name] for name in steps.touched], np.int64),
        names,
    )
    score = session.score()
    edits = cavity = None
    if session.operation is not None:
        if _wants_cavity(flown.chosen):
            cavity = cavity_of(session.operation.patient)
        edits = tuple(Taken(e.time_s, e.tool, e.taken_mm3) for e in steps.edits)
    radius_mm = measured.endoscope.diameter_mm / 2
    is_held = flown.samples.is_held.any()
    measured = replace(
        measured,
        contacts=contacts,
        hazards=_gaps(times, list(steps.scope), FARTHEST_MM - radius_mm),
        tool_hazards=_gaps(times, steps.tool, FARTHEST_MM) if is_held else None,
        edits=edits,
        breaches=_breaches(score),
        coverage=None if session.coverage is None else session.coverage.figures(),
        mucosa=None if session.coverage is None else session.coverage.mucosa,
        cavity=cavity,
    )
    return measured, score


def _wants_cavity(chosen: tuple[Definition, ...]) -> bool:
    names = {definition.name for definition in CAVITY}
    return any(definition.name in names for definition in chosen)


def _breaches(score: Score) -> tuple[Breach, ...] | None:
    if score.operation is None:
        return None
    return tuple(
        Breach(f.time_s, f.structure, f.by, f.depth_mm)
        for f in score.operation.injuries
    )


def _expert(folder: Path, info: SessionInfo) -> Track:
    """Return the scope's track of another session; UserError for another head."""
    recording = read_recording(folder)
    if recording.info.surface_sha256 != info.surface_sha256:
        raise UserError(
            f"{folder} was flown through another head: its path cannot be compared."
        )
    samples = SampleColumns.of(_sample_records(recording))
    return scope_track(
        samples, np.array(recording.info.world_from_device).reshape(4, 4)
    )


def _gaps(
    times: NDArray[np.float64],
    rows: Sequence[dict[str, float] | None],
    farthest_mm: float,
) -> HazardGaps | None:
    """Return the gaps by hazard of what each sample showed."""
    named = dict.fromkeys(name for row in rows if row is not None for name in row)
    gaps = {
        name: np.array([np.nan if row is None else row[name] for row in rows])
        for name in named
    }
    return _named_gaps(times, gaps, farthest_mm)


def _named_gaps(
    times: NDArray[np.float64],
    gaps: Mapping[str, NDArray[np.float64]] | None,
    farthest_mm: float,
) -> HazardGaps | None:
    """Return the gaps by hazard; without what every scope glides along."""
    if gaps is None:
        return None
    chosen = {name: mm for name, mm in gaps.items() if name not in ALWAYS_NEAR}
    return HazardGaps(times, chosen, farthest_mm) if chosen else None


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
