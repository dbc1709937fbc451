"""`paravol emulator`: a MicroScribe for other people's software."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from app.emulator_words import EmulatorWords
from devices import ProbePath, load_probe_path
from devices.microscribe.emulator import stop_on_signals
from devices.microscribe.emulator_actions import list_actions
from devices.microscribe.emulator_faults import list_faults
from devices.microscribe.emulator_setup import (
    MOTIONS,
    EmulatorOptions,
    OpenEmulator,
    open_emulator,
)
from scenarios import load_scenario
from scenarios.bundle import SampleRecord, read_session

BUNDLED = "first_flight"

# The emulated arm presses it by itself while it follows a path.
_PATH_PEDAL = 2


def run_emulator(words: EmulatorWords) -> int:
    """Emulate until Ctrl-C or until a fault unplugs the arm for good.

    The name of the port goes to standard output, alone on its line, and again when
    the arm is plugged in elsewhere. Everything else goes to standard error.
    """
    if words.list_faults:
        print(list_faults())
    if words.list_actions:
        print(list_actions())
    if words.list_faults or words.list_actions:
        return 0
    with (
        open_emulator(
            _options(words), lambda port: print(port, flush=True)
        ) as emulator,
        stop_on_signals(emulator),
    ):
        print("Ctrl-C ends the emulated arm.", file=sys.stderr)
        emulator.server.run()
    _report(emulator)
    return 0


def _options(words: EmulatorWords) -> EmulatorOptions:
    if words.path is not None and words.motion is not None:
        raise ValueError("give --path or --motion, not both")
    options = EmulatorOptions(
        profile=words.profile,
        motion=words.motion or MOTIONS[0],
        seed=words.seed,
        faults=words.fault,
        actions=words.do,
        listen=words.listen,
        link=words.link,
        transcript=words.transcript,
        fast=words.fast,
        sync_repeats=words.sync_repeats,
        accepts_memory_writes=words.accept_memory_writes,
    )
    if words.path is not None:
        return replace(options, path=load_motion(words.path))
    if words.motion is not None:
        return options
    # As in a training session: fiducials first.
    scenario, folder = load_scenario(BUNDLED)
    return replace(
        options,
        path=load_probe_path(folder / scenario.path),
        fiducials_mm=np.array([f.position_mm for f in scenario.fiducials]),
    )


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
