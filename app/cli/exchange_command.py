"""`paravol export` of a session, and `paravol path`: tool motion in and out."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from app.cli.root import FLATTENED, Json
from app.cli.terminal import print_json, print_table
from system import UserError

SessionFormat = Literal["perktutor", "seq", "csv"]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class PathOptions:
    """Options of a path's import, as they were typed.

    Parameters
    ----------
    out
        The probe path, NAME.path.json; train flies it with --input recording:FILE.
    scope
        Transform that is the scope's tip; ScopeTipToRas, or the only one there is.
    instrument
        Transform that is the instrument's tip; without it the second hand is empty.
    frame
        What the transforms end in: ras, as Slicer and PerkTutor have it, or lps.
    pointing
        The tool's own axis from the hand to the tip: +x -x +y -y +z -z.
    """

    out: Path
    scope: str | None = None
    instrument: str | None = None
    frame: Literal["ras", "lps"] = "ras"
    pointing: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = "-z"


def run_session_export(
    session: Path, out: Path, kind: SessionFormat, *, as_json: bool
) -> int:
    """Write a session's motion to a file, tell what is in it."""
    from paravol.exchange.perktutor import write_perktutor
    from paravol.exchange.sample_table import write_samples
    from paravol.exchange.sequence_file import write_sequence
    from paravol.exchange.tool_motion import motions_of
    from scenarios.bundle import read_recording

    recording = read_recording(session)
    if kind == "csv":
        counts = {"samples": write_samples(out, recording)}
    else:
        motions = motions_of(recording)
        write = write_perktutor if kind == "perktutor" else write_sequence
        write(out, motions)
        counts = {tool.name: int(tool.valid.sum()) for tool in motions.tools}
        if kind == "perktutor":
            counts["messages"] = len(motions.messages)
    if as_json:
        print_json({"file": str(out), "written": counts})
    else:
        print_table(str(out), [(name, str(count)) for name, count in counts.items()])
    return 0


def path(
    recording: Path, *, options: Annotated[PathOptions, FLATTENED], json: Json = False
) -> int:
    """Make a path that can be flown of a recording, another program's or our own.

    Parameters
    ----------
    recording
        PerkTutor's .xml, a .seq.mha, .igs.mha or .seq.nrrd of 3D Slicer or PLUS, or a
        session, NAME.paravol.
    """
    from devices import save_probe_path
    from paravol.exchange.flown_path import path_of, read_motions
    from paravol.exchange.tool_motion import SCOPE, tool_named

    if options.out.suffix != ".json":
        raise UserError(f"a path goes to a .path.json file, got {options.out}")
    motions = read_motions(recording, options.frame)
    path = path_of(
        motions,
        options.out.name.removesuffix(".json").removesuffix(".path"),
        scope=options.scope,
        instrument=options.instrument,
        pointing=options.pointing,
    )
    save_probe_path(path, options.out)
    name = motions.tools[0].name if len(motions.tools) == 1 else SCOPE
    tool = tool_named(motions.tools, options.scope or name)
    left_out = len(tool.time_s) - len(path.t_s)
    figures = {
        "poses": len(path.t_s),
        "left_out": left_out,
        "seconds": path.duration_s,
        "length_mm": path.length_mm,
    }
    if json:
        print_json({"file": str(options.out), "scope": tool.name, **figures})
        return 0
    print_table(
        str(options.out),
        [
            ("scope", tool.name),
            ("poses", str(len(path.t_s))),
            ("left out", f"{left_out}, invalid or not later than the one before"),
            ("lasts", f"{path.duration_s:.1f} s"),
            ("length", f"{path.length_mm:.0f} mm"),
        ],
    )
    print(f"Fly it with: paravol train --input recording:{options.out}")
    return 0
