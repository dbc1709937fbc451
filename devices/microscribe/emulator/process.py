"""An emulated MicroScribe as a process of its own, for ``MicroScribeEmulator``.

    python -m devices.microscribe.emulator.process JSON

The argument is an object with the file of the path and the settings that differ from
``EmulatorSettings``. Whenever the port appears a line of JSON with its name goes to
standard output. The arm serves until its standard input ends (every line there is an
action's name), its parent dies, a fault unplugs it, or it is told to stop.
"""

import json
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import numpy as np

from devices.microscribe.emulator.setup import (
    EmulatorSettings,
    OpenEmulator,
    open_emulator,
)
from devices.recording.path_file import load_probe_path


def main(asked: str) -> int:
    """Run an emulated arm until it is told to stop."""
    opened: list[OpenEmulator] = []

    def announce(port: str) -> None:
        place = opened[0].device_from_world
        assert place is not None
        ready = {"port": port, "device_from_world": place.tolist()}
        print(json.dumps(ready), flush=True)

    try:
        with open_emulator(_settings(asked), announce) as emulator:
            opened.append(emulator)
            with stop_on_signals(emulator):
                emulator.server.run(sys.stdin.fileno(), dies_with_parent=True)
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


def _settings(asked: str) -> EmulatorSettings:
    given = json.loads(asked)
    given["path"] = load_probe_path(given["path"])
    if "fiducials_mm" in given:
        given["fiducials_mm"] = np.array(given["fiducials_mm"])
    if "link" in given:
        given["link"] = Path(given["link"])
    return EmulatorSettings(**given)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
