"""`paravol emulator`: a MicroScribe for other people's software."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from devices import ProbePath, load_probe_path
from devices.microscribe.emulator import stop_on_signals
from devices.microscribe.emulator_actions import list_actions
from devices.microscribe.emulator_faults import list_faults
from devices.microscribe.emulator_setup import (
    EmulatorOptions,
    OpenEmulator,
    open_emulator,
)
from scenarios import load_scenario
from scenarios.bundle import SampleRecord, read_session

BUNDLED = "first_flight"

# The emulated arm presses it by itself while it follows a path.
_PATH_PEDAL = 2


@dataclass(frozen=True, slots=True)
class EmulatorCommand:
    """Hold what the command line asked for; see `paravol emulator --help`."""

    options: EmulatorOptions
    path: Path | None
    """A .path.json file or a recorded session."""
    follows_bundled: bool
    """Whether the bundled path is flown when none is given."""


def run_emulator(command: EmulatorCommand) -> int:
    """Emulate until Ctrl-C or until a fault unplugs the arm for good.

    The name of the port goes to standard output, alone on its line, and again when
    the arm is plugged in elsewhere. Everything else goes to standard error.
    """
    options = command.options
    if command.path is not None:
        options = replace(options, path=load_motion(command.path))
    elif command.follows_bundled:
        # As in a training session: fiducials first.
        scenario, folder = load_scenario(BUNDLED)
        options = replace(
            options,
            path=load_probe_path(folder / scenario.path),
            fiducials_mm=np.array([f.position_mm for f in scenario.fiducials]),
        )
    with (
        open_emulator(options, lambda port: print(port, flush=True)) as emulator,
        stop_on_signals(emulator),
    ):
        print("Ctrl-C ends the emulated arm.", file=sys.stderr)
        emulator.server.run()
    _report(emulator)
    return 0


def print_lists(*, faults: bool, actions: bool) -> int:
    """Print what --fault and --do know, one line each."""
    if faults:
        print(list_faults())
    if actions:
        print(list_actions())
    return 0


def load_motion(file: Path) -> ProbePath:
    """Read a path file, or the way of the scope in a recorded session."""
    if not file.is_dir():
        return load_probe_path(file)
    info, records, _ = read_session(file)
    samples = [
        record.sample() for record in records if isinstance(record, SampleRecord)
    ]
    # Samples before the flight carry the time -1.
    flown = [sample for sample in samples if sample.time_s >= 0.0]
    kept = [
        sample
        for i, sample in enumerate(flown)
        if i == 0 or sample.time_s > flown[i - 1].time_s
    ]
    if len(kept) < 2:
        raise ValueError(f"{file} holds no flight that an arm could follow.")
    world_from_device = np.array(info.world_from_device).reshape(4, 4)
    poses = world_from_device @ np.array([sample.device_from_tip for sample in kept])
    return ProbePath(
        name=file.stem,
        source=f"recorded session {file.name}",
        t_s=np.array([sample.time_s - kept[0].time_s for sample in kept]),
        tip_mm=poses[:, :3, 3],
        axis=-poses[:, :3, 2],
        roll_deg=np.array([sample.roll_deg for sample in kept]),
        instrument_tip_mm=np.array([sample.instrument_tip_mm for sample in kept]),
        instrument_axis=np.array([sample.instrument_pointing for sample in kept]),
        buttons=np.array([sample.buttons & ~_PATH_PEDAL for sample in kept]),
    )


def _report(emulator: OpenEmulator) -> None:
    arm = emulator.server.arm
    for name, times in arm.fired.items():
        print(f"{name} happened {times} times.", file=sys.stderr)
    writes = arm.far_end.memory_writes
    if writes:
        print(
            f"{writes} attempts to rewrite the calibration memory were "
            f"{'let through' if emulator.accepts_memory_writes else 'refused'}.",
            file=sys.stderr,
        )
