"""A recorded session at any time, forwards and backwards."""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from itertools import accumulate
from pathlib import Path

from paravol.patient import (
    PatientScene,
    Progress,
    StrPath,
    load_patient,
    no_progress,
)
from paravol.sessions.keyframes import Keyframes
from paravol.sessions.session_setup import reopen_session
from renderers.scene import Change
from scenarios import Sample, Score
from scenarios.bundle import FrameRecord, Recording, read_recording
from system import UserError

GRACE_S = 1.0
"""So long after its end a session or exercise still shows its last view."""


def _time_of(frame: tuple[float, FrameRecord]) -> float:
    return frame[0]


class SessionTimeline:
    """Show a recorded session's patient, score and injuries as they were at a time.

    patient: its tissue is edited in place. session: as the samples up to the last one
    gone to have left it. recording: what is gone through. keyframes: those known, which
    may be shared with others who step this session. steps: samples stepped so far, in
    all; it says what going somewhere cost.
    """

    def __init__(
        self,
        folder: StrPath,
        patient: PatientScene | None = None,
        recording: Recording | None = None,
        *,
        size: tuple[int, int] | None = None,
        progress: Progress = no_progress,
        keyframes: Keyframes | None = None,
    ) -> None:
        """Open a session before its first sample.

        patient: the one that was flown through, where it is loaded already, as it was
        before anybody operated. recording: of the folder, where it is read already.
        size: ``(width, height)`` of the views; None as recorded. keyframes: of this
        session, where some are known. UserError when the session cannot be read, holds
        nothing, or was flown through another head.
        """
        self._folder = Path(folder)
        self.recording = recording or read_recording(self._folder)
        info = self.recording.info
        self._samples = self.recording.samples
        if not self._samples:
            raise UserError(f"{folder} holds no sample; nothing was recorded.")
        # a clock that ran backwards stands until it has caught up
        self._times = list(accumulate((r.time_s for r in self._samples), max))
        self._frames: list[tuple[float, FrameRecord]] = []
        for record in self.recording.records:
            if isinstance(record, FrameRecord):
                place = self.recording.places.get(record.sample)
                if place is not None:
                    self._frames.append((self._times[place], record))
        self._frames.sort(key=_time_of)
        if patient is None:
            scenario = info.exercise()
            patient = load_patient(scenario, progress)
        self.patient, self.session = reopen_session(self._folder, info, patient, size)
        self.steps = 0
        self._place = -1
        self._sample: Sample | None = None
        self.keyframes = Keyframes() if keyframes is None else keyframes
        self._keep()

    @property
    def begin_s(self) -> float:
        """Return the time of the first sample."""
        return self._times[0]

    @property
    def end_s(self) -> float:
        """Return the time of the last sample."""
        return self._times[-1]

    @property
    def sample_times_s(self) -> list[float]:
        """Return the times of all samples, never falling."""
        return list(self._times)

    @property
    def frame_times_s(self) -> list[float]:
        """Return the times that the recorded frames show, never falling."""
        return list(accumulate((time_s for time_s, _ in self._frames), max))

    @property
    def place(self) -> int:
        """Return the place of the sample last gone to; -1 before the first."""
        return self._place

    def go_to(
        self, time_s: float, report: Callable[[float], None] = lambda _: None
    ) -> tuple[Sample, list[Change]]:
        """Go to the newest sample at or before a time, before the first to that one.

        Returns it, and what in the scene's arrays became different on the way there.
        report: told the share of the samples that are stepped, between any two; what it
        raises ends the way there, and the next call goes on from where it ended.
        UserError for a time before 0 or after the end.
        """
        if not 0.0 <= time_s <= self.end_s + GRACE_S:
            raise UserError(
                f"{self._folder} lasts from {max(self.begin_s, 0.0):.1f} to "
                f"{self.end_s:.1f} s and has nothing at {time_s:g} s; name a time "
                "between."
            )
        place = max(bisect_right(self._times, time_s) - 1, 0)
        nearest = self.keyframes.before(place)
        assert nearest is not None
        if place < self._place or nearest.place > self._place:
            self.session.restore(nearest.state)
            self._place, self._sample = nearest.place, nearest.sample
        operation = self.session.operation
        first, count = self._place, place - self._place
        while self._place < place:
            self._step()
            report((self._place - first) / count)
        assert self._sample is not None
        return self._sample, [] if operation is None else operation.take_changes()

    def walk(self) -> Iterator[Sample]:
        """Step to the end, and yield each sample when the session has taken it in.

        Whoever looks on can take what it did to the patient; the rest is forgotten.
        """
        while self._place + 1 < len(self._samples):
            self._take_in()
            assert self._sample is not None
            yield self._sample
            self._forget()

    def resize(self, size: tuple[int, int]) -> None:
        """Let views be of another size, ``(width, height)``, from now on."""
        self.session.size = size

    def score(self) -> Score:
        """Return the score so far, what was taken, bled and hurt included."""
        return self.session.score()

    def frame(self, time_s: float) -> FrameRecord | None:
        """Return the recorded frame whose sample is nearest to a time, if any."""
        if not self._frames:
            return None
        after = bisect_left(self._frames, time_s, key=_time_of)
        beside = self._frames[max(after - 1, 0) : after + 1]
        nearest_s = min((at_s for at_s, _ in beside), key=lambda t: abs(t - time_s))
        # of several frames of one moment the first
        return self._frames[bisect_left(self._frames, nearest_s, key=_time_of)][1]

    def _step(self) -> None:
        """Take in the next sample; keep a keyframe where one is due."""
        self._take_in()
        self._forget()

    def _take_in(self) -> None:
        self._place += 1
        self.steps += 1
        self._sample = self._samples[self._place].sample()
        self.session.step(self._sample)

    def _forget(self) -> None:
        """Drop what nobody took, and keep a keyframe where one is due."""
        if self.session.operation is not None:
            # nobody asks for them: the patient's books and the score have them
            self.session.operation.take_edits()
            self.session.operation.take_injuries()
        self._keep()

    def _keep(self) -> None:
        """Keep a keyframe of now, where one is due."""
        time_s = self._times[max(self._place, 0)]
        self.keyframes.follow(self._place, time_s, self._sample, self.session)
