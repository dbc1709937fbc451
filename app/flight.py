"""The live loop: poses in, frames out, everything recorded."""

import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from app.endoscope_view import EndoscopeView, Frame
from devices import Pose
from scenarios import Sample, Session, View
from scenarios.bundle import FrameRecord, SampleRecord, SessionRecorder

PATIENCE_S = 2.0
"""How long the loop waits for a pose before it says that the device is silent. The
driver itself notices a lost line within about a second."""


SWITCH_S = 0.0005
"""How long a thread may keep the interpreter while others wait for it. Python's 5 ms
make a rendering thread that comes back from a kernel wait for the arm's thread."""

OnFrame = Callable[[View, Frame, Sample, int], None]
"""Called with each finished frame, its view, its sample and its number."""


class Aim(Protocol):
    """What the second channel says at a moment: roll and the second tool."""

    def complete(self, pose: Pose) -> Sample:
        """Join a pose with the second channel's state at its time."""
        ...


class OrderedPoses(Protocol):
    """Poses in the order in which they were measured."""

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; TimeoutError when none comes in time."""
        ...


@dataclass(slots=True)
class Timing:
    """Gather what a flight took, frame by frame."""

    frame_ms: list[float] = field(default_factory=list)
    pose_age_ms: list[float] = field(default_factory=list)
    wall_s: float = 0.0

    @property
    def fps(self) -> float:
        """Get the mean number of frames per second of wall time."""
        return len(self.frame_ms) / self.wall_s if self.wall_s > 0 else 0.0

    def figures(self) -> dict[str, Any]:
        """Give frames, fps and the percentiles of frame time and pose age."""
        return {
            "frames": len(self.frame_ms),
            "fps": self.fps,
            "frame_ms": self.percentiles(self.frame_ms),
            "pose_age_ms": self.percentiles(self.pose_age_ms),
        }

    @staticmethod
    def percentiles(values: list[float]) -> dict[str, float]:
        """Give the 50th, 95th and 99th percentile by name; zeros for nothing."""
        cuts = np.percentile(values, (50, 95, 99)) if values else np.zeros(3)
        return dict(zip(("p50", "p95", "p99"), (float(c) for c in cuts), strict=True))


def fly(
    source: OrderedPoses,
    aim: Aim,
    session: Session,
    view: EndoscopeView,
    recorder: SessionRecorder,
    *,
    until_s: float,
    on_frame: OnFrame,
) -> Timing:
    """Fly until a sample's time reaches `until_s`.

    Every pose is recorded and scored; each frame shows the newest one. Errors of the
    device pass through; what was recorded before is on disk.
    """
    timing = Timing()
    sys.setswitchinterval(SWITCH_S)
    with ThreadPoolExecutor(1, thread_name_prefix="develop") as developer:
        line = _DevelopmentLine(view, recorder, developer, timing, on_frame)
        started = time.perf_counter()
        while True:
            newest: _Shot | None = None
            for pose in _arrived(source):
                sample = aim.complete(pose)
                if sample.time_s >= until_s:
                    line.finish()
                    timing.wall_s = time.perf_counter() - started
                    return timing
                if sample.time_s < 0.0:
                    started = time.perf_counter()
                    continue
                seen = session.step(sample)
                recorder.add(SampleRecord.of(sample))
                newest = _Shot(pose, sample, seen, recorder.samples - 1)
            if newest is not None:
                line.take(newest)


@dataclass(frozen=True, slots=True)
class _Shot:
    """The newest sample when a frame was begun; `index` counts samples from 0."""

    pose: Pose
    sample: Sample
    view: View
    index: int


class _DevelopmentLine:
    """Two stages at work on two frames: one finds its geometry, one is lit.

    Each stage alone leaves a core idle in its serial parts; together they do not. The
    1995 system pipelined culling and rendering for the same reason.
    """

    def __init__(
        self,
        view: EndoscopeView,
        recorder: SessionRecorder,
        developer: ThreadPoolExecutor,
        timing: Timing,
        on_frame: OnFrame,
    ) -> None:
        self._view = view
        self._recorder = recorder
        self._developer = developer
        self._timing = timing
        self._on_frame = on_frame
        self._number = 0
        self._shown = time.perf_counter()
        self._pending: tuple[_Shot, float, Future[Frame]] | None = None

    def take(self, shot: _Shot) -> None:
        """Begin a frame; the one before it is delivered meanwhile."""
        begun = time.perf_counter()
        buffer = self._view.gbuffer(shot.view)
        self.finish()
        future = self._developer.submit(
            self._view.develop,
            shot.view,
            buffer,
            number=self._number,
            elapsed_s=begun - self._shown,
        )
        self._shown = begun
        self._pending = shot, begun, future

    def finish(self) -> None:
        """Deliver the frame that is being lit, if there is one."""
        if self._pending is None:
            return
        shot, begun, future = self._pending
        self._pending = None
        frame = future.result()
        self._timing.frame_ms.append((time.perf_counter() - begun) * 1e3)
        age_s = time.monotonic() - shot.pose.host_time_s
        self._timing.pose_age_ms.append(age_s * 1e3)
        self._recorder.add(
            FrameRecord(
                self._number,
                shot.index,
                frame.gain,
                shot.view.clearance_mm,
                frame.blake2b,
            )
        )
        self._on_frame(shot.view, frame, shot.sample, self._number)
        self._number += 1


def _arrived(source: OrderedPoses) -> Iterator[Pose]:
    """Wait for one pose, then give all that have come in meanwhile."""
    yield source.read(PATIENCE_S)
    while True:
        try:
            pose = source.read(0.0)
        except TimeoutError:
            return
        yield pose
