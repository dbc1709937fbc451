"""An emulated MicroScribe as a process of its own.

    python -m devices.microscribe.emulator.process --path FILE [--fiducial=x,y,z ...]

prints one line of JSON with the port's name when it is ready, and another one whenever
the port comes back under a new name. It runs until its standard input ends (with
``--watch-stdin``, where every line is an action's name), its parent dies, a fault
unplugs it, or it is told to stop. `paravol emulator` is the same for a person.
"""

import argparse
import json
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.emulator.setup import (
    MOTIONS,
    EmulatorOptions,
    OpenEmulator,
    open_emulator,
)
from devices.recording.path_file import load_probe_path
from disk import UserError


def main(arguments: list[str] | None = None) -> int:
    """Run an emulated arm until it is told to stop."""
    options = _parser().parse_args(arguments)
    opened: list[OpenEmulator] = []

    def announce(port: str) -> None:
        place = opened[0].device_from_world
        ready = {
            "port": port,
            "profile": options.profile,
            "device_from_world": None if place is None else place.tolist(),
        }
        print(json.dumps(ready), flush=True)

    try:
        with open_emulator(_wanted(options), announce) as emulator:
            opened.append(emulator)
            watched = sys.stdin.fileno() if options.watch_stdin else None
            with stop_on_signals(emulator):
                emulator.server.run(watched, dies_with_parent=True)
    except (ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


@contextmanager
def stop_on_signals(emulator: OpenEmulator) -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the service instead of tearing it down."""

    def stop(number: int, frame: FrameType | None) -> None:
        emulator.server.stop()

    before = {n: signal.signal(n, stop) for n in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _wanted(options: argparse.Namespace) -> EmulatorOptions:
    path = None if options.path is None else load_probe_path(options.path)
    fiducials = np.array(options.fiducial, dtype=np.float64).reshape(-1, 3)
    return EmulatorOptions(
        profile=options.profile,
        path=path,
        fiducials_mm=fiducials,
        motion=options.motion,
        seed=options.seed,
        faults=tuple(options.fault),
        actions=tuple(options.do),
        listen=options.listen,
        link=options.link,
        transcript=options.transcript,
        fast=options.fast,
        sync_repeats=options.sync_repeats,
    )


def _point(text: str) -> NDArray[np.float64]:
    point = np.array([float(part) for part in text.split(",")])
    if point.shape != (3,) or not np.isfinite(point).all():
        raise UserError(f"a point is x,y,z in mm, got {text!r}")
    return point


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("emulator", description=__doc__)
    parser.add_argument("--path", help="probe path to follow")
    parser.add_argument("--motion", choices=MOTIONS, default="orbit")
    parser.add_argument("--profile", default="dx40937")
    parser.add_argument(
        "--fiducial", action="append", type=_point, default=[], metavar="X,Y,Z"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fault", action="append", default=[], metavar="NAME@WHEN")
    parser.add_argument("--do", action="append", default=[], metavar="NAME@S[+S]")
    parser.add_argument("--listen", metavar="[HOST:]PORT")
    parser.add_argument("--link", type=Path)
    parser.add_argument("--transcript", type=Path)
    parser.add_argument("--sync-repeats", type=int, default=1)
    parser.add_argument("--fast", action="store_true", help="no line delays")
    parser.add_argument("--watch-stdin", action="store_true")
    return parser


if __name__ == "__main__":
    sys.exit(main())
