"""An emulated MicroScribe at the far end of a pseudo-terminal.

    python -m devices.microscribe.emulator --path FILE [--fiducial=x,y,z ...]

prints one line of JSON with the port's name when it is ready and runs until its
standard input ends (with ``--watch-stdin``), its parent dies, or it is told to stop.
"""

import argparse
import errno
import json
import os
import random
import select
import signal
import sys
import time
from types import FrameType

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.emulator_faults import parse_fault
from devices.microscribe.emulator_line import FaultyLine, PacedOutput, client_rate
from devices.microscribe.emulator_placement import place_arm
from devices.microscribe.emulator_script import ArmScript
from devices.microscribe.emulator_state import FarEnd, FarState
from devices.microscribe.profiles import PROFILES
from devices.recording import load_probe_path

# How often an idle emulator looks whether its parent still lives.
IDLE_S = 0.5

DEFAULT_RATE = 115200

_SILENT = (FarState.SYNC, FarState.WAIT_BEGIN)


class TerminalEmulator:
    """One arm behind one pseudo-terminal."""

    def __init__(
        self, far_end: FarEnd, script: ArmScript, line: FaultyLine, fast: bool
    ) -> None:
        import tty

        self._far_end = far_end
        self._script = script
        self._line = line
        self._output = PacedOutput(fast)
        self._session_rate = DEFAULT_RATE
        # Our own descriptor of the client's end keeps the terminal alive between two
        # clients. Raw before anybody opens it: 03 is a poll and not an interrupt.
        self._master, self._client = os.openpty()
        tty.setraw(self._client)
        os.set_blocking(self._master, False)
        self.stopped = False

    @property
    def port_name(self) -> str:
        """Get what a client opens."""
        return os.ttyname(self._client)

    def run(self, watched: int | None) -> None:
        """Serve until stopped, unplugged, orphaned or ``watched`` comes to its end."""
        parent = os.getppid()
        sources = [self._master] + ([] if watched is None else [watched])
        while not self.stopped and os.getppid() == parent:
            ready, _, _ = select.select(sources, [], [], self._wait_s())
            now = time.monotonic()
            if watched in ready and not os.read(watched or 0, 4096):
                break
            if self._line.unplugged(self._script.elapsed_s(now)):
                break
            self._serve(now, self._master in ready)

    def close(self) -> None:
        """Take the port away."""
        os.close(self._client)
        os.close(self._master)

    def _wait_s(self) -> float:
        due = [self._output.next_s(), self._far_end.next_s()]
        soonest = min((t for t in due if t is not None), default=float("inf"))
        return min(IDLE_S, max(0.0, soonest - time.monotonic()))

    def _serve(self, now: float, readable: bool) -> None:
        rate = client_rate(self._master) or DEFAULT_RATE
        heard = os.read(self._master, 4096) if readable else b""
        if self._far_end.state in _SILENT:
            self._session_rate = rate
        same_rate = rate == self._session_rate
        if not same_rate:
            heard = self._line.misread(heard)
        polls = self._far_end.standard_commands
        answer = self._far_end.receive(heard, now)
        if self._far_end.standard_commands > polls:
            self._script.begin(now)
        self._output.push(answer, self._session_rate, now)
        said = self._output.due(time.monotonic())
        if not same_rate:
            said = self._line.misread(said)
        self._write(self._line.to_client(said, self._script.elapsed_s(now)))

    def _write(self, data: bytes) -> None:
        try:
            os.write(self._master, data)
        except OSError as error:
            # Nobody reads and the terminal is full: a UART drops the bytes, too.
            if error.errno != errno.EAGAIN:
                raise


def main(arguments: list[str] | None = None) -> int:
    """Run an emulated arm until it is told to stop."""
    options = _parser().parse_args(arguments)
    try:
        path = load_probe_path(options.path)
        profile = PROFILES[options.profile]
        fiducials = np.array(options.fiducial, dtype=np.float64).reshape(-1, 3)
        place = place_arm(profile, path, fiducials, options.seed)
        script = ArmScript(profile, path, place, fiducials, options.seed)
        line = FaultyLine(tuple(options.fault), random.Random(options.seed))
    except ValueError as error:
        print(error, file=sys.stderr)
        return 1
    far_end = FarEnd(profile, script, time.monotonic())
    emulator = TerminalEmulator(far_end, script, line, options.fast)

    def stop(number: int, frame: FrameType | None) -> None:
        emulator.stopped = True

    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGINT, stop)
    ready = {
        "port": emulator.port_name,
        "profile": options.profile,
        "device_from_world": place.tolist(),
    }
    print(json.dumps(ready), flush=True)
    try:
        emulator.run(sys.stdin.fileno() if options.watch_stdin else None)
    finally:
        emulator.close()
    return 0


def _point(text: str) -> NDArray[np.float64]:
    point = np.array([float(part) for part in text.split(",")])
    if point.shape != (3,) or not np.isfinite(point).all():
        raise ValueError(f"a point is x,y,z in mm, got {text!r}")
    return point


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("emulator", description=__doc__)
    parser.add_argument("--path", required=True, help="probe path to follow")
    parser.add_argument("--profile", choices=sorted(PROFILES), default="dx40937")
    parser.add_argument(
        "--fiducial", action="append", type=_point, default=[], metavar="X,Y,Z"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--fault", action="append", type=parse_fault, default=[], metavar="NAME@S"
    )
    parser.add_argument("--fast", action="store_true", help="no line delays")
    parser.add_argument("--watch-stdin", action="store_true")
    return parser


if __name__ == "__main__":
    sys.exit(main())
