"""All that a debrief tells of one session, gathered in one pass over its samples."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices import load_probe_path
from paravol.patient import PatientScene, Progress
from paravol.scoring.session_metrics import SessionMetrics, session_metrics
from paravol.sessions.keyframes import APART_S, Keyframes, save_keyframes
from paravol.sessions.session_timeline import SessionTimeline
from scenarios import Sample, Scenario, Score, Session, load_scenario, tip_frame
from scenarios.bundle import Recording
from scenarios.coverage import CoverageWatch
from scenarios.metrics import Measured, Metric, Settings, Track, measure
from system import UserError

Interval = tuple[float, float]

BLOOD_EVERY_S = 0.25
"""Between two readings of how much has bled."""

EXPERT = "the scenario's recorded path"


@dataclass(slots=True)
class Followed:
    """Look on while a session is stepped, and keep what its end does not tell.

    time_s, clock_s: of each sample, and what the score's clock showed. blood: times and
    millilitres bled so far. frozen: spans. coverage: of the mucosa, as at the last
    sample.
    """

    time_s: list[float] = field(default_factory=list)
    clock_s: list[float] = field(default_factory=list)
    blood: list[tuple[float, float]] = field(default_factory=list)
    frozen: list[Interval] = field(default_factory=list)
    coverage: CoverageWatch | None = None
    _frozen_s: float | None = None

    def watch(self, session: Session, sample: Sample) -> None:
        """Take in one sample that the session has stepped."""
        self.time_s.append(sample.time_s)
        self.clock_s.append(session.clock_s)
        self.coverage = session.coverage
        if sample.is_frozen and self._frozen_s is None:
            self._frozen_s = sample.time_s
        elif not sample.is_frozen and self._frozen_s is not None:
            self.frozen.append((self._frozen_s, sample.time_s))
            self._frozen_s = None
        if session.operation is None:
            return
        last_s = self.blood[-1][0] if self.blood else -np.inf
        if sample.time_s >= last_s + BLOOD_EVERY_S:
            self.blood.append((sample.time_s, session.operation.film.books.bled_ml))

    def end(self) -> None:
        """Close what the last sample left open."""
        if self._frozen_s is not None:
            self.frozen.append((self._frozen_s, self.time_s[-1]))

    def session_time(self, clock_s: float) -> float:
        """Return when the score's clock first showed a time."""
        place = int(np.searchsorted(self.clock_s, clock_s, side="left"))
        return self.time_s[min(place, len(self.time_s) - 1)]


@dataclass(frozen=True, slots=True)
class Compared:
    """What a session is compared with.

    title: what it is. track: of its scope. rows: the own metric and the other one.
    """

    title: str
    track: Track
    rows: list[tuple[Metric, Metric]]


@dataclass(frozen=True, slots=True)
class Findings:
    """What a session showed; `compared`: None with a reason in `why_alone`.

    timeline: of the session, stepped to its end: any moment is a short way back.
    """

    name: str
    recording: Recording
    scenario: Scenario
    patient: PatientScene
    metrics: SessionMetrics
    score: Score
    followed: Followed
    compared: Compared | None
    why_alone: str
    timeline: SessionTimeline

    @property
    def begin_s(self) -> float:
        """Return the first sample's time."""
        return self.followed.time_s[0]

    @property
    def end_s(self) -> float:
        """Return the last sample's time."""
        return self.followed.time_s[-1]


def gather(
    folder: Path,
    scenario: Scenario,
    recording: Recording,
    patient: PatientScene,
    *,
    compare: Path | None,
    settings: Settings,
    progress: Progress,
    keyframes: Keyframes | None = None,
) -> Findings:
    """Step a session through its head once, and measure it.

    patient: as before anybody operated. compare: another session of the same head; None
    for the path that the scenario brings, where it brings one. keyframes: of the
    session, which grow on the way; saved at its end. UserError as in
    `session_metrics`.
    """
    track, why = None, ""
    if compare is None:
        track, why = _expert_track(scenario)
    followed = Followed()
    timeline = SessionTimeline(folder, patient, recording, keyframes=keyframes)
    is_kept = timeline.keyframes.until_s >= timeline.end_s - APART_S
    found = session_metrics(
        folder,
        settings=settings,
        expert=compare if compare is not None else track,
        progress=progress,
        patient=patient,
        watch=followed.watch,
        timeline=timeline,
    )
    followed.end()
    if not is_kept:
        save_keyframes(folder, patient, timeline.keyframes)
    score = found.score
    assert score is not None
    compared = None
    if compare is not None:
        other = session_metrics(
            compare, settings=settings, progress=progress, patient=patient
        )
        rows = _paired(found.metrics, other.metrics)
        compared = Compared(compare.name, other.measured.scope, rows)
    elif track is not None:
        alone = Measured(track, Track.none(), settings=found.settings)
        compared = Compared(EXPERT, track, _paired(found.metrics, measure(alone)))
    return Findings(
        folder.name,
        recording,
        scenario,
        patient,
        found,
        score,
        followed,
        compared,
        why,
        timeline,
    )


def _expert_track(scenario: Scenario) -> tuple[Track | None, str]:
    """Return the way that comes with a scenario, or why there is none."""
    if not scenario.path:
        return None, "The scenario brings no recorded path to compare with."
    try:
        known, folder = load_scenario(scenario.name)
        if known.head != scenario.head or known.path != scenario.path:
            return None, "The scenario's path is not one that comes with the program."
        path = load_probe_path(folder / known.path)
    except UserError:
        return None, "The scenario's path is not one that comes with the program."
    frames = [tip_frame(t, a) for t, a in zip(path.tip_mm, path.axis, strict=True)]
    poses: NDArray[np.float64] = np.stack(frames)
    return Track.of_frames(path.t_s, poses), ""


def _paired(own: list[Metric], other: list[Metric]) -> list[tuple[Metric, Metric]]:
    """Return the metrics of which both sides have a value."""
    known = {(m.role, m.name): m for m in other}
    return [
        (metric, known[metric.role, metric.name])
        for metric in own
        if metric.value is not None
        and (metric.role, metric.name) in known
        and known[metric.role, metric.name].value is not None
    ]
