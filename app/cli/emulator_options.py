"""The options of `paravol emulator`, with their help."""

from dataclasses import dataclass
from pathlib import Path

from cyclopts import Parameter

from app.cli.root import Flag, Json, Seed


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
