"""The program with its window, flown by a recorded path on a screen of its own.

It is looked at from outside, as a user's system monitor does: no part of it knows that
it is measured. Linux and Xvfb are needed.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.machine import ROOT
from benchmarks.plan import UnavailableError
from devices import ProbePath, save_probe_path
from scenarios.bundle import FrameRecord, read_session

LOOKED_EVERY_S = 0.25
"""Between two looks at memory and CPU time."""

SETTLED_S = 60.0
"""Memory is compared from so long after the first picture: what is made once is there
then. In two minutes on the bundled path 1,343 MiB became 1,367 within 46 s, in lumps,
and stayed so. Of a shorter flight it is compared from the middle."""

STARTING_S = 120.0
"""A program that shows no picture for so long has failed."""

_TICKS_PER_S = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100
_MIB = 1024.0


@dataclass(frozen=True, slots=True)
class ProcessUse:
    """One look at a process, seconds since its start.

    rss_mib: memory that it has in use. window_cpu_s: of its first thread, which is
    Qt's. cpu_s: of all threads.
    """

    at_s: float
    rss_mib: float
    window_cpu_s: float
    cpu_s: float


@dataclass(frozen=True, slots=True)
class WindowFlight:
    """What was seen of a flight in the window, and what its recording says.

    first_s: from the start of the process until its first pictures are recorded, at
    most `LOOKED_EVERY_S` too long. timing: as in the recording's result. sizes: edge of
    each picture, pixels. looks: from the first picture to the end.
    """

    first_s: float
    timing: dict[str, float | dict[str, float]]
    sizes: list[int]
    looks: list[ProcessUse] = field(repr=False)

    def counters(self) -> dict[str, float]:
        """Return the figures of a benchmark row."""
        first, last = self.looks[0], self.looks[-1]
        frames = max(len(self.sizes), 1)
        wall_s = max(last.at_s - first.at_s, 1e-3)
        cpu_s = last.cpu_s - first.cpu_s
        window_s = last.window_cpu_s - first.window_cpu_s
        begin, end, slope = self.memory()
        found = {
            "frames": float(len(self.sizes)),
            "start_to_picture_s": self.first_s,
            "start_cpu_s": first.cpu_s,
            "picture_px_p50": float(np.median(self.sizes)),
            "picture_px_mean": float(np.mean(self.sizes)),
            "window_cpu_share": window_s / wall_s,
            "flight_cpu_share": (cpu_s - window_s) / wall_s,
            "cpu_ms_a_frame": 1e3 * cpu_s / frames,
            "window_cpu_ms_a_frame": 1e3 * window_s / frames,
            "rss_begin_mib": begin,
            "rss_end_mib": end,
            "rss_mib_a_minute": slope,
        }
        for name, value in self.timing.items():
            if isinstance(value, dict):
                found |= {f"{name}_{rank}": each for rank, each in value.items()}
            else:
                found[name] = float(value)
        return found

    def memory(self) -> tuple[float, float, float]:
        """Return memory in use at the begin and the end, MiB, and MiB a minute.

        The slope is that of the straight line through all looks once it has settled.
        """
        first, last = self.looks[0].at_s, self.looks[-1].at_s
        from_s = min(first + SETTLED_S, (first + last) / 2)
        kept = [look for look in self.looks if look.at_s >= from_s]
        minutes = np.array([look.at_s for look in kept]) / 60.0
        used = np.array([look.rss_mib for look in kept])
        slope = float(np.polyfit(minutes, used, 1)[0]) if len(kept) > 1 else 0.0
        return float(used[0]), float(used[-1]), slope


def to_and_fro(path: ProbePath, duration_s: float) -> ProbePath:
    """Return a path flown forwards and backwards in turn, until it is long enough.

    Nothing is pressed on it: what is cut away would stay away.
    """
    count = len(path.t_s)
    steps = np.diff(path.t_s)
    turns = max(int(np.ceil(duration_s / float(path.t_s[-1]))), 1)
    order, times = [np.arange(count)], [path.t_s]
    for turn in range(1, turns):
        back = turn % 2 == 1
        order.append(np.arange(count - 1)[::-1] if back else np.arange(1, count))
        times.append(times[-1][-1] + np.cumsum(steps[::-1] if back else steps))
    at, t_s = np.concatenate(order), np.concatenate(times)
    kept = t_s <= duration_s
    kept[:2] = True
    at, t_s = at[kept], t_s[kept]
    return replace(
        path,
        t_s=t_s,
        tip_mm=path.tip_mm[at],
        axis=path.axis[at],
        roll_deg=path.roll_deg[at],
        instrument_tip_mm=path.instrument_tip_mm[at],
        instrument_axis=path.instrument_axis[at],
        buttons=np.zeros(len(at), np.int64),
        tools=(),
        instrument_roll_deg=path.instrument_roll_deg[at],
        jaw=path.jaw[at],
        scopes=(),
    )


def begin_of(path: ProbePath, duration_s: float) -> ProbePath:
    """Return what a path does until a time."""
    kept = path.t_s <= duration_s
    names = [
        f.name for f in fields(path) if isinstance(getattr(path, f.name), np.ndarray)
    ]
    return replace(path, **{name: getattr(path, name)[kept] for name in names})


def fly_window(
    scenario: str, path: ProbePath | float, screen: tuple[int, int], size: int
) -> WindowFlight:
    """Fly a path in the window to its end, all panels on; size: largest picture.

    scenario: its name or file. path: or seconds, to be operated by the mouse for (see
    `app.steered_window`). screen: width and height of the virtual one, pixels.
    Raises UnavailableError where there is no Xvfb, or the program fails.
    """
    if not Path("/proc/self/task").exists():
        raise UnavailableError("the window's CPU time is read from /proc, as in Linux")
    with tempfile.TemporaryDirectory() as place, _virtual_screen(screen) as display:
        folder = Path(place)
        file, record = folder / "flown.path.json", folder / "flown.paravol"
        if isinstance(path, float):
            words = ["app.steered_window", "--input", "mouse"]
            flown_s = path
        else:
            save_probe_path(path, file)
            words = ["app", "train", "--input", f"recording:{file}"]
            flown_s = float(path.t_s[-1]) + 1.0
        words += ["--scenario", scenario, "--record", str(record)]
        words += ["--size", str(size), "--sound", "off", "--no-store"]
        words += ["--seconds", str(flown_s)]
        environment = os.environ | {"DISPLAY": display}
        for name in ("WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
            environment.pop(name, None)
        begun_s = time.monotonic()
        with (
            tempfile.TemporaryFile() as said,
            subprocess.Popen(
                [sys.executable, "-m", *words],
                cwd=ROOT,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=said,
            ) as child,
        ):
            try:
                looks = list(_looks(child, record, begun_s))
            finally:
                if child.poll() is None:
                    child.terminate()
            child.wait()
            if child.returncode or not looks:
                said.seek(0)
                last = said.read().decode(errors="replace").strip().splitlines()[-1:]
                told = "".join(last) or "no picture came"
                raise UnavailableError(f"paravol train ended early: {told}")
        result = msgspec.json.decode((record / "result.json").read_bytes())
        info, records, _ = read_session(record)
        session = info.picture_size
        sizes = [r.size_of(session)[0] for r in records if isinstance(r, FrameRecord)]
    first_s = looks[0].at_s
    return WindowFlight(first_s, result["timing"], sizes, looks)


def _looks(
    child: "subprocess.Popen[bytes]", record: Path, begun_s: float
) -> Iterator[ProcessUse]:
    """Look at the process from its first picture until it ends."""
    while child.poll() is None:
        at_s = time.monotonic() - begun_s
        if record.exists():
            if (record / "result.json").exists():
                # what is left of its life is its end
                child.wait()
                return
            try:
                yield _look(child.pid, at_s)
            except (OSError, ValueError, IndexError):
                return
        elif at_s > STARTING_S:
            return
        time.sleep(LOOKED_EVERY_S if record.exists() else LOOKED_EVERY_S / 5)


def _look(process: int, at_s: float) -> ProcessUse:
    root = Path(f"/proc/{process}")
    status = (root / "status").read_text()
    rss = next(line for line in status.splitlines() if line.startswith("VmRSS:"))
    return ProcessUse(
        at_s,
        float(rss.split()[1]) / _MIB,
        _cpu_s(root / "task" / str(process) / "stat"),
        _cpu_s(root / "stat"),
    )


def _cpu_s(stat: Path) -> float:
    """Return user and system time; what stands before is a name with spaces."""
    words = stat.read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / _TICKS_PER_S


@contextmanager
def _virtual_screen(size: tuple[int, int]) -> Iterator[str]:
    """Start a virtual screen; give its DISPLAY."""
    server = shutil.which("Xvfb")
    if server is None:
        raise UnavailableError("there is no Xvfb; `apt-get install xvfb` brings it")
    width, height = size
    reader, writer = os.pipe()
    command = [server, "-displayfd", str(writer), "-screen", "0"]
    command += [f"{width}x{height}x24", "-nolisten", "tcp"]
    with (
        os.fdopen(reader) as told,
        subprocess.Popen(
            command, pass_fds=[writer], stderr=subprocess.DEVNULL
        ) as child,
    ):
        os.close(writer)
        try:
            number = told.readline().strip()
            if not number:
                raise UnavailableError("Xvfb does not start")
            yield f":{number}"
        finally:
            child.terminate()
