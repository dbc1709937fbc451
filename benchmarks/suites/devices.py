"""What reading an arm costs, and how late its poses are.

Throughput at 823 packets a second, the most that any packet of six encoders reaches on
the fastest line; a packet with the timer, which a pose needs, reaches 720 there.
"""

import subprocess
import sys
import tempfile
import threading
import time
from array import array
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.machine import ROOT
from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.schema import Setting
from benchmarks.timing import Timing
from devices.microscribe.driver.driver import MicroScribe
from devices.microscribe.driver.sampler import MotionReports
from devices.port import DeviceError

FASTEST_HZ = 823.0
TICKS_PER_S = 900.0
POLL_HZ = 100.0

FRAME_S = 1.0 / 60.0

SOAK_S = 600.0
LONG_S, SHORT_S = 20.0, 4.0

AT_ONCE = MotionReports(period_ticks=1, confirmed_only=False)
CONFIRMED = MotionReports(period_ticks=1)


class DevicesPlan(Plan, suite="devices"):
    """List and make the measurements of suite `devices`."""

    def __init__(self, quick: bool) -> None:
        self._seconds = SHORT_S if quick else LONG_S
        self._quick = quick

    def tasks(self) -> list[Task]:
        """List the tasks, the soak last."""
        found = [
            self._task("823 packets/s", "at once", AT_ONCE),
            self._task("823 packets/s", "confirmed", CONFIRMED),
            self._task("823 packets/s", "frame loop", CONFIRMED, FRAME_S),
            self._task("100 polls/s", "polled", None),
        ]
        if not self._quick:
            self._seconds = SOAK_S
            found.append(self._task("soak", "frame loop", CONFIRMED, FRAME_S))
        return found

    def _task(
        self,
        case: str,
        mode: str,
        reports: MotionReports | None,
        frame_s: float | None = None,
    ) -> Task:
        seconds = self._seconds

        def measure() -> Measured:
            return measure_reader(reports, seconds, frame_s)

        settings: dict[str, Setting] = {"seconds": seconds}
        cost_s = seconds + 5.0
        return self.task(case, mode, measure, settings, cost_s=cost_s)


def measure_reader(
    reports: MotionReports | None, seconds: float, frame_s: float | None = None
) -> Measured:
    """Read an arm for a while, each pose awaited or all drained every ``frame_s``.

    Timing: seconds from a packet's last byte to its pose in the reader's hands, and
    the CPU time of the driver's thread for one pose. Raises UnavailableError where no
    arm can be emulated.
    """
    if sys.platform == "win32":
        raise UnavailableError("an emulated arm needs pseudo-terminals")
    with tempfile.TemporaryDirectory(prefix="paravol-arm-") as folder:
        log = Path(folder) / "notes"
        words = ["-m", "benchmarks.suites.arm_pump", "--hz", str(FASTEST_HZ), "--log"]
        with subprocess.Popen(
            [sys.executable, *words, str(log)],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        ) as child:
            assert child.stdin is not None
            assert child.stdout is not None
            port = child.stdout.readline().decode().strip()
            try:
                read = _Reading(port, reports, seconds, frame_s)
            except DeviceError as error:
                raise UnavailableError(str(error)) from error
            finally:
                child.stdin.close()
                child.wait()
        notes = array("d")
        notes.frombytes(log.read_bytes())
    return read.measured(np.array(notes).reshape(-1, 2))


class _Reading:
    """Poses read for a while, and what that cost."""

    def __init__(
        self,
        port: str,
        reports: MotionReports | None,
        seconds: float,
        frame_s: float | None,
    ) -> None:
        self._reports = reports
        self.ticks: list[float] = []
        self.came_s: list[float] = []
        with MicroScribe(port, reports=reports, poll_hz=POLL_HZ) as arm:
            cpu = _cpu_clock("microscribe")
            arm.read(2.0)
            before, began = cpu(), time.monotonic()
            while time.monotonic() - began < seconds:
                if frame_s is None:
                    poses = [arm.read(2.0)]
                else:
                    time.sleep(frame_s)
                    poses = arm.drain()
                now = time.monotonic()
                self.came_s += [now] * len(poses)
                self.ticks += [round(pose.time_s * TICKS_PER_S) for pose in poses]
            self.cpu_s = cpu() - before
            self.wall_s = time.monotonic() - began
            self.counters = arm.counters

    def measured(self, notes: NDArray[np.float64]) -> Measured:
        """Compare with what was sent; nothing is known of when polls were answered."""
        counters = {
            name: float(self.counters[name])
            for name in ("framing", "noise", "stray", "missed", "refused", "jumps")
        }
        counters["poses"] = float(len(self.ticks))
        counters["cpu percent of one core"] = 100.0 * self.cpu_s / self.wall_s
        per_pose = self.cpu_s / len(self.ticks)
        if self._reports is None:
            return Measured(
                Timing(per_pose, per_pose, per_pose, len(self.ticks)), counters=counters
            )
        late = np.array(self.came_s) - self._known_s(notes)
        ends = np.searchsorted(notes[:, 0], (self.ticks[0], self.ticks[-1]))
        counters["lost"] = float(ends[1] - ends[0] + 1 - len(self.ticks))
        for percent in (50, 99):
            ms = 1e3 * float(np.percentile(late, percent))
            counters[f"latency p{percent} ms"] = ms
        timing = Timing(
            float(late.min()), float(np.median(late)), per_pose, len(self.ticks)
        )
        return Measured(timing, counters=counters)

    def _known_s(self, notes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return when the last byte that each pose needed was written.

        A confirmed pose needs the next packet's first byte.
        """
        assert self._reports is not None
        at = np.searchsorted(notes[:, 0], self.ticks)
        known: NDArray[np.float64] = notes[at + self._reports.confirmed_only, 1]
        return known


def _cpu_clock(name: str) -> Callable[[], float]:
    """Return a clock of the CPU time of the thread with that name."""
    thread = next(t for t in threading.enumerate() if t.name == name)
    assert thread.ident is not None
    clock = time.pthread_getcpuclockid(thread.ident)
    return lambda: time.clock_gettime(clock)
