"""`paravol emulator`: a MicroScribe for other people's software."""

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import Parameter

from app.cli.root import Flag, Json, Seed
from app.cli.terminal import print_json
from system import UserError

if TYPE_CHECKING:
    from devices import ProbePath
    from devices.microscribe.emulator.setup import EmulatorSettings, OpenEmulator

BUNDLED = "first_flight"

# The emulated arm presses it by itself while it follows a path.
_PATH_PEDAL = 2


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class EmulatorOptions:
    """Options of the emulated arm, as they were typed.

    Parameters
    ----------
    probe_path
        What to follow: a .path.json file or a recorded session NAME.paravol. The
        bundled path, fiducials first, when neither path nor motion is given.
    motion
        Without a path: orbit circles beside the base, rest stands still.
    profile
        Which arm: dx40937 (short: dx), 3dx_b, nominal, standard, 6dof, ibox,
        odd_maxima (t9) or g2_unhomed (g2).
    listen
        Serve a TCP port instead of a terminal: PORT, on this machine only, or
        HOST:PORT; 0 takes any that is free. For pyserial: socket://127.0.0.1:PORT.
    link
        Symbolic link to the terminal, kept right when it is plugged in elsewhere.
    fault
        Misbehave as NAME[=VARIANT][@WHEN]; --list-faults names all faults.
    do
        Do something to the arm, as NAME@SECONDS[+DURATION]; see --list-actions.
    seed
        Where the arm stands beside the patient, and the chances of faults: the same
        seed gives the same ones.
    sync_repeats
        How often the arm must hear IMMC before it echoes; real ones want up to 6.
    transcript
        Write every byte, its time and its meaning to this file.
    fast
        Answer at once instead of at the pace of the line.
    accept_memory_writes
        Grant the password for the calibration memory instead of refusing it.
    list_faults
        Print all faults with one line each.
    list_actions
        Print all actions with one line each.
    json
        Print JSON: an object a line for every port and one at the end, or the lists.
    """

    probe_path: Path | None = None
    motion: str | None = None
    profile: str = "dx40937"
    listen: str | None = None
    link: Path | None = None
    fault: tuple[str, ...] = ()
    do: tuple[str, ...] = ()
    seed: Seed = 0
    sync_repeats: int = 1
    transcript: Path | None = None
    fast: Flag = False
    accept_memory_writes: Flag = False
    list_faults: Flag = False
    list_actions: Flag = False
    json: Json = False


NOTHING_TYPED = EmulatorOptions()


def emulator(*, options: EmulatorOptions = NOTHING_TYPED) -> int:
    """Emulate a MicroScribe behind a pseudo-terminal and print the port's name.

    Any program that talks to the arm over a serial port can open it:

        paravol emulator
        paravol emulator --profile dx --probe-path hand.path.json
        paravol emulator --motion orbit --listen 4455
        paravol emulator --fault f8_dropped_byte@12.5 --fault f30
        paravol emulator --fault flipped_bit@p:0.01 --seed 7
        paravol emulator --fault unplug@packet:200 --transcript line.txt
        paravol emulator --link arm --do unplug@5+2 --do right_pedal@3+.5

    A fault is NAME[=VARIANT][@WHEN]: SECONDS since the first packet (0, or nothing,
    means from power-on), SECONDS+DURATION, packet:N or p:PROBABILITY for each packet.
    """
    from devices.microscribe.emulator.process import stop_on_signals
    from devices.microscribe.emulator.setup import open_emulator

    # the port's name goes to standard output, alone on its line, and again when the arm
    # is plugged in elsewhere; all else to standard error. With --json every line is an
    # object, and a last one tells what happened
    if options.list_faults or options.list_actions:
        _print_lists(options)
        return 0
    settings = _settings(options)

    def announce(port: str) -> None:
        about = {
            "profile": settings.profile,
            "faults": options.fault,
            "actions": options.do,
        }
        print(json.dumps({"port": port, **about}) if options.json else port, flush=True)

    with open_emulator(settings, announce) as emulator, stop_on_signals(emulator):
        if not options.json:
            print("Ctrl-C ends the emulated arm.", file=sys.stderr)
        emulator.server.run()
    if options.json:
        print(json.dumps(_happened(emulator)))
    else:
        _report(emulator)
    return 0


def _print_lists(options: EmulatorOptions) -> None:
    from devices.microscribe.emulator.actions import list_actions
    from devices.microscribe.emulator.faults.catalogue import list_faults

    lists = {"faults": list_faults()} if options.list_faults else {}
    lists |= {"actions": list_actions()} if options.list_actions else {}
    if options.json:
        print_json(lists)
        return
    for lines in lists.values():
        for name, line in lines.items():
            print(f"{name:<20} {line}")


def _happened(emulator: "OpenEmulator") -> dict[str, Any]:
    """Return how often each fault happened and the memory was to be rewritten."""
    return {
        "fired": dict(emulator.server.arm.fired),
        "memory_writes": emulator.server.arm.firmware.memory_writes,
        "memory_writes_granted": emulator.accepts_memory_writes,
    }


def _settings(options: EmulatorOptions) -> "EmulatorSettings":
    import numpy as np

    from devices import load_probe_path
    from devices.microscribe.emulator.setup import MOTIONS, EmulatorSettings
    from scenarios import load_scenario

    if options.probe_path is not None and options.motion is not None:
        raise UserError("give --probe-path or --motion, not both")
    settings = EmulatorSettings(
        profile=options.profile,
        motion=options.motion or MOTIONS[0],
        seed=options.seed,
        faults=options.fault,
        actions=options.do,
        listen=options.listen,
        link=options.link,
        transcript=options.transcript,
        fast=options.fast,
        sync_repeats=options.sync_repeats,
        accepts_memory_writes=options.accept_memory_writes,
    )
    if options.probe_path is not None:
        return replace(settings, path=load_motion(options.probe_path))
    if options.motion is not None:
        return settings
    # As in a training session: fiducials first.
    scenario, folder = load_scenario(BUNDLED)
    return replace(
        settings,
        path=load_probe_path(folder / scenario.path),
        fiducials_mm=np.array([f.position_mm for f in scenario.fiducials]),
    )


def load_motion(file: Path) -> "ProbePath":
    """Read a path file, or the way of the scope in a recorded session."""
    import numpy as np

    from devices import ProbePath, load_probe_path
    from scenarios.bundle import SampleRecord, read_session

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
        raise UserError(f"{file} holds no flight that an arm could follow.")
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


def _report(emulator: "OpenEmulator") -> None:
    happened = _happened(emulator)
    for name, times in happened["fired"].items():
        print(f"{name} happened {times} times.", file=sys.stderr)
    writes = happened["memory_writes"]
    if writes:
        fate = "let through" if happened["memory_writes_granted"] else "refused"
        print(
            f"{writes} attempts to rewrite the calibration memory were {fate}.",
            file=sys.stderr,
        )
