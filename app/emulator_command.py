"""`paravol emulator`: a MicroScribe for other people's software."""

import time
from pathlib import Path

import numpy as np

from devices.microscribe import MicroScribeEmulator
from scenarios import load_scenario

LOOK_S = 0.2


def run_emulator(*, path: Path | None, seed: int, faults: tuple[str, ...]) -> int:
    """Emulate until Ctrl-C or until the arm is unplugged by a fault.

    Without a path of one's own the arm plays the bundled scenario: fiducials first.
    """
    fiducials = None
    if path is None:
        scenario, folder = load_scenario("first_flight")
        path = folder / scenario.path
        fiducials = np.array([f.position_mm for f in scenario.fiducials])
    with MicroScribeEmulator(
        path, fiducials_mm=fiducials, seed=seed, faults=faults
    ) as arm:
        print(arm.port_name, flush=True)
        while arm.running:
            time.sleep(LOOK_S)
    return 0
