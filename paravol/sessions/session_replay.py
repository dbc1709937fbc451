"""Run a recorded session again, without the device: same frames, same score."""

from collections import deque
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, closing
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from paravol.patient import (
    PatientScene,
    Progress,
    StrPath,
    load_patient,
    no_progress,
    thread_count,
)
from paravol.sessions.session_setup import build_view, reopen_session
from paravol.sessions.video import VideoWriter
from paravol.view import Frame
from renderers.shading import LOOK_VERSION
from scenarios import Sample, Score
from scenarios.bundle import (
    Damage,
    EditRecord,
    FrameRecord,
    PatientRecord,
    Recording,
    SessionInfo,
    read_recording,
)
from system import UserError
from system.typed_record import read_kept

VIDEO_FPS = 30.0


@dataclass(frozen=True, slots=True)
class ReplayReport:
    """What a replay found.

    complete: the recording was closed properly.
    differing_frames, differing_clearances: numbers of the frames whose picture or
        whose clearance differs from the recorded one.
    same_look: whether the recording is of the look that this version draws; the
        pictures of another look are drawn but not compared.
    score: computed again from the recorded poses.
    same_score: whether it equals the recorded one, figure by figure, the names of
        structures only where this version gives the same; None when the recording
        ended before it had one, or is damaged.
    damages: parts of the recording that cannot be read; the rest was run.
    seconds: of flight from the first sample to the last.
    differing_edits: numbers of the edits that did not come out as recorded.
    differing_patients: times at which the operated patient is not the recorded one.
    """

    complete: bool
    samples: int
    frames: int
    differing_frames: list[int]
    differing_clearances: list[int]
    score: Score
    same_score: bool | None
    same_look: bool
    damages: tuple[Damage, ...]
    seconds: float
    differing_edits: list[int] = field(default_factory=list)
    differing_patients: list[float] = field(default_factory=list)

    @property
    def good_s(self) -> float:
        """Return the seconds of flight that could be read."""
        return self.seconds - sum(lost.to_s - lost.from_s for lost in self.damages)

    @property
    def is_exact(self) -> bool:
        """Return whether all came out again as recorded, as far as it was recorded."""
        return not (
            self.damages
            or self.differing_frames
            or self.differing_clearances
            or self.differing_edits
            or self.differing_patients
            or self.same_score is False
        )


@dataclass(frozen=True, slots=True)
class ReplayedFrame:
    """A recorded frame, drawn again.

    time_s: of the session. rgb: ``(h, w, 3)`` uint8 sRGB. depth_mm: ``(h, w)`` float32
    along each pixel's ray, +inf where nothing is met. is_same: whether the picture is
    the recorded one, to the bit; None where it was recorded with another look.
    """

    number: int
    time_s: float
    rgb: NDArray[np.uint8]
    depth_mm: NDArray[np.float32]
    is_same: bool | None


class _Plan:
    """Sort a recording by what shows what.

    A frame is recorded when it is finished, after newer samples have come, but it shows
    the patient as the samples up to its own had left it. samples: in order. frames: by
    the place of the sample that they show. edits: by number. patients: by time.
    """

    def __init__(self, recording: Recording) -> None:
        self.samples = recording.samples
        self.frames: dict[int, list[FrameRecord]] = {}
        self.edits: dict[int, EditRecord] = {}
        self.patients: dict[float, PatientRecord] = {}
        for record in recording.records:
            if isinstance(record, FrameRecord):
                place = recording.places.get(record.sample)
                if place is not None:
                    self.frames.setdefault(place, []).append(record)
            elif isinstance(record, EditRecord):
                self.edits[record.number] = record
            elif isinstance(record, PatientRecord):
                self.patients[record.time_s] = record


class Replay:
    """Run a recorded session again: iterate over `frames` once, then ask to `report`.

    The arguments are those of `replay_session`.
    """

    def __init__(
        self,
        folder: StrPath,
        threads: int | None = None,
        progress: Progress = no_progress,
        patient: PatientScene | None = None,
    ) -> None:
        self._folder = folder = Path(folder)
        self._progress = progress
        self.recording = read_recording(folder)
        info = self.recording.info
        scenario = info.exercise()
        patient = patient or load_patient(scenario, progress)
        patient, self._session = reopen_session(folder, info, patient)
        self.patient, self._operation = patient, self._session.operation
        self._view = build_view(
            scenario,
            patient,
            tier=info.tier,
            seed=info.seed,
            has_instrument=info.has_instrument or info.operated,
            threads=threads or thread_count(),
            progress=progress,
            visible_sets=info.visible_sets,
        )
        self._same_look = info.look == LOOK_VERSION
        self._unlike: frozenset[str] = frozenset()
        if not patient.structures_sha256 == info.structures_sha256 != "":
            self._unlike |= _NAMES
        if not self._same_look:
            self._unlike |= _SEEN
        if patient.hazards_sha256 != info.hazards_sha256:
            self._unlike |= _HAZARDS
        self.samples: list[Sample] = []
        self._count = 0
        self._edits: list[int] = []
        self._patients: list[float] = []
        self._pictures: list[int] = []
        self._clearances: list[int] = []

    def frames(
        self, then: Callable[[ReplayedFrame], None] | None = None
    ) -> Generator[ReplayedFrame, None, None]:
        """Draw every recorded frame again, in order, and score every sample.

        then: called with each frame by the thread that finishes it, while the next one
        is begun.
        """
        finished: deque[ReplayedFrame] = deque()
        plan = _Plan(self.recording)
        count = len(plan.samples)
        try:
            for place, record in enumerate(plan.samples):
                sample = record.sample()
                self._session.step(sample)
                self.samples.append(sample)
                self._compare_edits(plan, sample.time_s)
                for shown in plan.frames.get(place, ()):
                    self._begin(shown, sample, finished, then)
                    while finished:
                        yield finished.popleft()
                self._progress("Replaying", (place + 1) / count)
        finally:
            # interrupted, no frame is left in the making
            self._view.settle()
        if self._operation is not None:
            # recorded, but nothing in the samples made them
            self._edits += sorted(plan.edits)
        yield from finished

    def _compare_edits(self, plan: "_Plan", time_s: float) -> None:
        """Check that the samples so far made the edits, and left the patient."""
        operation = self._operation
        if operation is None:
            return
        for edit in operation.take_edits():
            if plan.edits.pop(edit.number, None) != EditRecord.of(edit):
                self._edits.append(edit.number)
        known = plan.patients.get(time_s)
        if known is not None and known.xxh3_128 != operation.patient.hash():
            self._patients.append(time_s)

    def _begin(
        self,
        record: FrameRecord,
        sample: Sample,
        finished: deque[ReplayedFrame],
        then: Callable[[ReplayedFrame], None] | None,
    ) -> None:
        """Begin to draw a frame; the one before is finished afterwards."""
        if self._operation is not None:
            self._view.apply(self._operation.take_changes())
            if self._operation.lens is not None:
                self._view.lens = self._operation.lens.state
        size = record.size_of(self._session.size)
        seen = self._session.view(sample, size)

        def finish(frame: Frame) -> None:
            is_same = None
            if self._same_look:
                is_same = frame.fingerprint() == record.xxh3_128
                if not is_same:
                    self._pictures.append(record.number)
            depth_mm = frame.gbuffer.depth_mm
            made = ReplayedFrame(
                record.number, sample.time_s, frame.pixels, depth_mm, is_same
            )
            if then is not None:
                then(made)
            finished.append(made)

        self._view.begin(
            seen, number=record.number, elapsed_s=0.0, gain=record.gain, then=finish
        )
        self._count += 1
        if seen.clearance_mm != record.clearance_mm:
            self._clearances.append(record.number)

    def report(self) -> ReplayReport:
        """Return what the replay found."""
        recording, samples = self.recording, self.samples
        score = self._session.score()
        same_score = None
        if not recording.damages:
            same_score = _same_score(self._folder, score, self._unlike)
        return ReplayReport(
            complete=recording.complete,
            samples=len(samples),
            frames=self._count,
            differing_frames=self._pictures,
            differing_clearances=self._clearances,
            score=score,
            same_score=same_score,
            same_look=self._same_look,
            damages=recording.damages,
            seconds=samples[-1].time_s - samples[0].time_s if samples else 0.0,
            differing_edits=self._edits,
            differing_patients=self._patients,
        )


def replay_session(
    folder: StrPath,
    *,
    threads: int | None = None,
    progress: Progress = no_progress,
    video: StrPath | VideoWriter | None = None,
    patient: PatientScene | None = None,
    faster: float = 1.0,
) -> ReplayReport:
    """Draw every recorded frame again, score every sample again and compare.

    video: an ``.mp4`` file to write, or a film of this picture size to go on with.
    patient: the one that was flown through, where it is loaded already, as it was
    before anybody operated. threads: None for all processors; they change no picture.
    faster: the film goes so many times as fast as the session went.
    UserError when the session cannot be read, or was flown through another head.
    """
    replayed = Replay(folder, threads, progress, patient)
    size = replayed.recording.info.picture_size
    with ExitStack() as stack:
        film: VideoWriter | None = None
        if isinstance(video, VideoWriter):
            film = video
        elif video is not None:
            film = stack.enter_context(VideoWriter(Path(video), size, VIDEO_FPS))
        begun_s = 0.0 if film is None else film.duration_s

        def show(frame: ReplayedFrame) -> None:
            if film is not None:
                film.show_until(frame.rgb, begun_s + frame.time_s / faster)

        frames = stack.enter_context(closing(replayed.frames(show)))
        last = deque(frames, maxlen=1)
        if film is not None and last:
            # the last frame was still to be seen when the flight ended
            whole_s = replayed.samples[-1].time_s / faster
            film.show_until(last[0].rgb, begun_s + whole_s)
    return replayed.report()


@dataclass(frozen=True, slots=True)
class RecordedSession:
    """What a session's folder says, without drawing anything.

    info: what was flown, how registered, with which versions. samples: what was
    measured, in order. is_complete: False where the recording ends in the middle.
    score: None where the flight did not reach its end.
    """

    info: SessionInfo
    samples: list[Sample]
    is_complete: bool
    score: Score | None


def replay_frames(
    folder: StrPath, patient: PatientScene | None = None
) -> Iterator[ReplayedFrame]:
    """Yield a session's frames as they are drawn again; errors as `replay_session`."""
    return Replay(folder, patient=patient).frames()


def read_session(folder: StrPath) -> RecordedSession:
    """Read a recorded session; UserError where the folder holds none."""
    recording = read_recording(Path(folder))
    samples = [record.sample() for record in recording.samples]
    score = recorded_score(Path(folder))
    return RecordedSession(recording.info, samples, recording.complete, score)


def recorded_score(folder: Path) -> Score | None:
    """Return the score in a session's result; None where it has none.

    UserError where it is damaged.
    """
    figures = _recorded_score(folder)
    try:
        return None if figures is None else msgspec.convert(figures, Score)
    except msgspec.ValidationError as error:
        raise UserError(f"{folder}/result.json is not valid: {error}.") from error


def recorded_hash(folder: Path) -> str:
    """Return the hash of the records that a result was made of; "" in older ones."""
    result = read_kept(folder / "result.json", _Recorded)
    return "" if result is None else result.stream


class _Recorded(msgspec.Struct):
    """The part of result.json that a replay computes again, and of which records."""

    score: dict[str, Any]
    stream: str = ""


_FIRST_FIGURES = frozenset(
    (
        "duration_s",
        "path_length_mm",
        "min_clearance_mm",
        "contacts",
        "target_distance_mm",
    )
)
"""Figures that every recorded score has."""

_NAMES = frozenset(("worst_structure", "touched_s", "tool", "coverage"))
"""Figures that depend on how the head's structures are named."""

_SEEN = frozenset(("coverage", "tasks"))
"""Figures that depend on how the lens gets dirty, which is a part of the look."""

_HAZARDS = frozenset(("hazards",))
"""Figures that depend on how the head's hazards were measured."""


def _recorded_score(folder: Path) -> dict[str, Any] | None:
    """Read the figures of the recorded score; None where there are none."""
    try:
        raw = (folder / "result.json").read_bytes()
    except FileNotFoundError:
        return None
    try:
        recorded = msgspec.json.decode(raw, type=_Recorded).score
    except (ValueError, RecursionError) as error:
        raise UserError(f"{folder}/result.json is not valid: {error}.") from error
    lacking = sorted(_FIRST_FIGURES - recorded.keys())
    if lacking:
        raise UserError(
            f"{folder}/result.json is not valid: its score has no {lacking[0]}."
        )
    return recorded


def _same_score(folder: Path, score: Score, unlike: frozenset[str]) -> bool | None:
    """Compare what was recorded; older recordings have fewer figures.

    unlike: figures that this version measures in another way.
    """
    recorded = _recorded_score(folder)
    if recorded is None:
        return None
    kept = {name: figure for name, figure in recorded.items() if name not in unlike}
    found = asdict(score)
    operation, operated = kept.pop("operation", None), found.pop("operation")
    if operation is None or operated is None:
        return _holds(found, kept) and operation == operated
    return _holds(found, kept) and _holds(operated, operation)


def _holds(found: dict[str, Any], recorded: dict[str, Any]) -> bool:
    """Return whether each figure that was recorded is found."""
    return all(
        name in found and found[name] == figure for name, figure in recorded.items()
    )
