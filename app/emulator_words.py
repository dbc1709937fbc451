"""The words of `paravol emulator`: options and help. The work is done elsewhere."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def emulator(
    *,
    path: Path | None = None,
    motion: str | None = None,
    profile: str = "dx40937",
    listen: str | None = None,
    link: Path | None = None,
    fault: Annotated[tuple[str, ...], Parameter(negative="")] = (),
    do: Annotated[tuple[str, ...], Parameter(negative="")] = (),
    seed: int = 0,
    sync_repeats: int = 1,
    transcript: Path | None = None,
    fast: Annotated[bool, Parameter(negative="")] = False,
    accept_memory_writes: Annotated[bool, Parameter(negative="")] = False,
    list_faults: Annotated[bool, Parameter(negative="")] = False,
    list_actions: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Emulate a MicroScribe behind a pseudo-terminal and print the port's name.

    Any program that talks to the arm over a serial port can open it:

        paravol emulator
        paravol emulator --profile dx --path hand.path.json
        paravol emulator --motion orbit --listen 4455
        paravol emulator --fault f8_dropped_byte@12.5 --fault f30
        paravol emulator --fault flipped_bit@p:0.01 --seed 7
        paravol emulator --fault unplug@packet:200 --transcript line.txt
        paravol emulator --link /tmp/arm --do unplug@5+2 --do right_pedal@3+.5

    The third listens at a TCP port, which pyserial opens as socket://127.0.0.1:4455.

    A fault is NAME[=VARIANT][@WHEN]: SECONDS since the first packet (0, or nothing,
    means from power-on), SECONDS+DURATION, packet:N or p:PROBABILITY for each packet.
    The same seed gives the same faults. Ctrl-C ends the arm.

    Parameters
    ----------
    path
        What to follow: a .path.json file or a recorded session NAME.paravol. The
        bundled path, fiducials first, when neither path nor motion is given.
    motion
        Without a path: orbit circles beside the base, rest stands still.
    profile
        Which arm: dx40937 (short: dx), 3dx_b, nominal, standard, 6dof, ibox,
        odd_maxima (t9) or g2_unhomed (g2).
    listen
        Serve a TCP port instead of a terminal: PORT, on this machine only, or
        HOST:PORT; 0 takes any that is free.
    link
        Symbolic link to the terminal, kept right when it is plugged in elsewhere.
    fault
        Misbehave in one of thirty ways; --list-faults names them all.
    do
        Do something to the arm, as NAME@SECONDS[+DURATION]; see --list-actions.
    seed
        Where the arm stands beside the patient, and the chances of faults.
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
    """
    from app.emulator_command import EmulatorCommand, print_lists, run_emulator
    from devices.microscribe.emulator_setup import EmulatorOptions

    if list_faults or list_actions:
        return print_lists(faults=list_faults, actions=list_actions)
    if path is not None and motion is not None:
        raise ValueError("give --path or --motion, not both")
    options = EmulatorOptions(
        profile=profile,
        motion=motion or "rest",
        seed=seed,
        faults=fault,
        actions=do,
        listen=listen,
        link=link,
        transcript=transcript,
        fast=fast,
        sync_repeats=sync_repeats,
        accepts_memory_writes=accept_memory_writes,
    )
    follows_bundled = path is None and motion is None
    return run_emulator(EmulatorCommand(options, path, follows_bundled))
