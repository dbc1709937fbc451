"""The live picture along the bundled flight: its stages, its loop, its likeness."""

import itertools
import tempfile
import time
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.nasal_views import Judge, acceptance_views, bundled_flight, path_views
from benchmarks.plan import Measured, Plan, Task
from benchmarks.schema import Setting
from benchmarks.timing import Timing, once
from devices import Pose, ProbePath, Registration, load_probe_path
from paravol.flight.flight_loop import Timing as LoopTiming
from paravol.flight.flight_loop import fly
from paravol.flight.operation_rehearsal import rehearse
from paravol.inputs.pose_completer import PATH_PEDAL, PathChannel
from paravol.patient import PatientScene, load_patient, no_progress
from paravol.sessions.session_setup import (
    LIVE_TIER,
    build_session,
    build_view,
    describe_session,
    first_views,
    operate_on,
    path_view,
)
from paravol.view import EndoscopeView, Frame
from renderers.scene import image_error
from renderers.shading import meter
from scenarios import FrameState, Scenario, Session, load_scenario, tip_frame
from scenarios.bundle import SessionRecorder

FULL_SIZE = 512
QUICK_SIZE = 192

POSE_HZ, ARM_HZ = 200.0, 100.0
"""Poses a second of the loop that is measured: the loop must never wait for one. And
of an operation: as many as the arm gives."""

OPERATED_S, OPERATED_QUICK_S = 38.0, 4.0
"""So much of the operation is flown, and by a quick run."""

STAGES = ("surface", "instrument", "light", "gain", "camera", "hash")


class FlightPlan(Plan, suite="flight"):
    """List and make the measurements of suite `flight`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._size = QUICK_SIZE if quick else FULL_SIZE
        self._places = 6 if quick else 50
        self._repeats = 2 if quick else 5
        self._flown_s = 3.0 if quick else bundled_flight()[1].duration_s
        self._compared = 2 if quick else 20
        self._operated_sizes = (QUICK_SIZE,) if quick else (FULL_SIZE, 2 * FULL_SIZE)
        self._views: dict[int, EndoscopeView] = {}

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        one, two = "1 thread", "2 threads"
        settings: dict[str, Setting] = {"size": self._size, "tier": LIVE_TIER}
        places = settings | {"places": self._places}
        loop: dict[str, Setting] = {"pose_hz": POSE_HZ, "flown_s": self._flown_s}
        likeness: dict[str, Setting] = {
            "series": "FSR live",
            "places": self._compared,
            "reference": "ART snapshot, same shading and gain",
        }
        case, stages = "first_flight/path/frame", self._stages
        on_one, on_two = partial(stages, 1), partial(stages, 2)
        threads: dict[str, Setting] = {"threads": 2}
        arm: dict[str, Setting] = threads | {"tier": LIVE_TIER, "pose_hz": ARM_HZ}
        task = partial(self.task, clock="wall")
        return [
            task(case, one, on_one, places | {"threads": 1}, cost_s=30.0),
            task(case, two, on_two, places | threads, one, cost_s=30.0),
            task(
                "first_flight/loop/frame",
                two,
                self._loop,
                settings | loop | threads,
                cost_s=self._flown_s + 10.0,
            ),
            *(
                task(
                    "first_operation/loop/frame",
                    f"{size} px",
                    partial(self._operation, size),
                    arm | {"size": size},
                    cost_s=60.0,
                )
                for size in self._operated_sizes
            ),
            self.task(
                "first_flight/likeness",
                "FSR live",
                self._likeness,
                settings | likeness,
                cost_s=60.0,
            ),
        ]

    @cached_property
    def _patient(self) -> PatientScene:
        return load_patient(bundled_flight()[0], no_progress)

    def _seen(self, time_s: float) -> FrameState:
        scenario, path = bundled_flight()
        return path_view(
            scenario, self._patient, path, time_s, (self._size, self._size)
        )

    def _view(self, threads: int) -> EndoscopeView:
        if threads not in self._views:
            flown = bundled_flight()
            view = _warm_view(*flown, self._patient, self._size, threads)
            self._views[threads] = view
        return self._views[threads]

    def _stages(self, threads: int) -> Measured:
        """Time every stage at places along the path, the least of a few repeats.

        A row's times are those of the middle place; its counters say how they are
        spread along the path.
        """
        view = self._view(threads)
        path = bundled_flight()[1]
        table = np.empty((self._places, len(STAGES)))
        spent: list[float] = []
        for place in range(self._places):
            seen = self._seen((place + 0.5) * path.duration_s / self._places)
            took = []
            for _ in range(self._repeats):
                cpu = time.process_time()
                took.append(stage_times(view, seen))
                spent.append(time.process_time() - cpu)
            table[place] = np.min(took, axis=0)
        frames = table.sum(axis=1)
        columns = dict(zip(STAGES, table.T, strict=True)) | {"frame": frames}
        counters = {
            f"{name}_ms_p{rank}": float(np.quantile(column, rank / 100)) * 1e3
            for name, column in columns.items()
            for rank in (50, 95, 99)
        }
        middle = float(np.median(frames))
        timing = Timing(middle, middle, float(np.median(spent)), self._repeats)
        return Measured(timing, counters=counters)

    def _loop(self) -> Measured:
        """Fly in real time: poses in, pictures out, everything scored and recorded."""
        scenario, path = bundled_flight()
        size = (self._size, self._size)
        session = build_session(scenario, self._patient, np.eye(4), size)
        poses = PacedPoses(path, POSE_HZ)
        flown = scenario, self._patient, session, self._view(2)
        return _flown(*flown, poses, self._flown_s)

    def _operation(self, size: int) -> Measured:
        """Fly the bundled operation: tissue is pushed, cut, bleeds and is sucked."""
        scenario, folder = load_scenario("first_operation")
        path = load_probe_path(folder / scenario.path)
        before = load_patient(scenario, no_progress)
        rehearse(scenario, before, no_progress)
        patient, operation = operate_on(before)
        view = _warm_view(scenario, path, patient, size, 2)
        session = build_session(scenario, patient, np.eye(4), (size, size), operation)
        flown_s = OPERATED_QUICK_S if self.quick else OPERATED_S
        poses = PacedPoses(path, ARM_HZ)
        return _flown(scenario, patient, session, view, poses, flown_s)

    def _likeness(self) -> Measured:
        """Compare with ray-traced pictures: the six named views and the path."""
        views = acceptance_views(self._size) + path_views(self._size, self._compared)
        found = []
        worst, least = None, 1.0
        for head in dict.fromkeys(view.head for view in views):
            judge = Judge(head)
            for view in views:
                if view.head != head:
                    continue
                agreement, splatted, traced = judge.compare(view)
                found.append(agreement)
                if worst is None or agreement.ssim < least:
                    least = agreement.ssim
                    worst = image_error(_unit(splatted), _unit(traced))
            judge.close()
        counters = {
            "ssim_mean": float(np.mean([a.ssim for a in found])),
            "ssim_min": least,
            "rmse_codes_max": max(a.rmse_codes for a in found),
            "normal_deg_max": max(a.normal_deg for a in found),
            "holes": float(sum(a.holes for a in found)),
            "openings": float(sum(a.openings for a in found)),
            "closed": float(sum(a.closed for a in found)),
        }
        middle = self._seen(bundled_flight()[1].duration_s / 2)
        timing, _ = once(partial(stage_times, self._view(1), middle))
        return Measured(timing, worst, "sRGB", counters)


def stage_times(view: EndoscopeView, seen: FrameState) -> list[float]:
    """Draw a frame stage by stage; give the seconds of each of `STAGES`."""
    times = [time.perf_counter()]

    def tick() -> None:
        times.append(time.perf_counter())

    buffer = view.tissue(seen)
    tick()
    view.add_instrument(seen, buffer)
    tick()
    radiance = view.light(seen, buffer)
    tick()
    gain = meter(radiance, buffer.material)
    tick()
    pixels = view.expose(seen, buffer, radiance, gain=gain, number=1)
    tick()
    Frame(pixels, buffer, gain).fingerprint()
    tick()
    return [after - before for before, after in itertools.pairwise(times)]


class PacedPoses:
    """Return the poses of a path when their time has come, as an arm does."""

    def __init__(self, path: ProbePath, rate_hz: float) -> None:
        self.path = path
        self._rate_hz = rate_hz
        self._began_s: float | None = None
        self._next = 0

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; TimeoutError when it is later than that."""
        now = time.monotonic()
        if self._began_s is None:
            self._began_s = now
        time_s = self._next / self._rate_hz
        wait_s = self._began_s + time_s - now
        if wait_s > timeout_s:
            raise TimeoutError(f"the next pose is due in {wait_s:.3g} s")
        if wait_s > 0:
            time.sleep(wait_s)
        self._next += 1
        at = self.path.sample(min(time_s, self.path.duration_s))
        frame = tip_frame(at.tip_mm, at.axis)
        return Pose(time_s, self._began_s + time_s, frame, PATH_PEDAL)


def _warm_view(
    scenario: Scenario, path: ProbePath, patient: PatientScene, size: int, threads: int
) -> EndoscopeView:
    view = build_view(scenario, patient, threads=threads)
    view.warm_up(first_views(scenario, patient, path, (size, size)), no_progress)
    return view


def _flown(
    scenario: Scenario,
    patient: PatientScene,
    session: Session,
    view: EndoscopeView,
    poses: PacedPoses,
    until_s: float,
) -> Measured:
    registration = Registration(np.eye(4), 0.0, np.zeros(0))
    size = session.size[0]
    info = describe_session(
        scenario, patient, registration, size=size, has_instrument=True
    )
    with (
        tempfile.TemporaryDirectory() as folder,
        SessionRecorder(Path(folder) / "flight.paravol", info) as recorder,
    ):
        timing = fly(
            poses,
            PathChannel(poses.path).complete,
            session,
            view,
            recorder,
            until_s=until_s,
            on_frame=lambda *_: None,
            keeps=lambda _: False,
        )
    return _of_loop(timing)


def _of_loop(timing: LoopTiming) -> Measured:
    frames = len(timing.frame_ms)
    counters = {"frames": float(frames), "frames_per_s": timing.fps}
    figures = timing.figures()
    counters |= {"cores": figures["cores"]}
    counters |= {f"{name}_share": share for name, share in figures["shares"].items()}
    for name, values in (("frame", timing.frame_ms), ("pose_age", timing.pose_age_ms)):
        for rank, value in timing.percentiles(values).items():
            counters[f"{name}_ms_{rank}"] = value
    least, middle = min(timing.frame_ms), float(np.median(timing.frame_ms))
    return Measured(
        Timing(least / 1e3, middle / 1e3, timing.cpu_s / frames, frames),
        counters=counters,
    )


def _unit(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    return picture.astype(np.float32) / np.float32(255)
