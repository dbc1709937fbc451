"""`paravol import`: make a case of a scan, print what was found."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec

from app.cli.root import FLATTENED, Json
from app.cli.slices_command import quality_lines
from app.cli.terminal import ProgressReporter, print_json, print_table
from paravol.cases.case_options import ImportOptions

if TYPE_CHECKING:
    from anatomy.case import CaseRecord
    from anatomy.scan.imported import ImportedHead
    from paravol.cases.case_import import ImportedCase

LISTED_CAVITIES = 6

LISTED_OPENING_MM2 = 5.0
"""Smaller ones are a voxel or two."""


def import_(
    scan: Path, *, options: Annotated[ImportOptions, FLATTENED], json: Json = False
) -> int:
    """Make a case of a patient's own CT or MR, to be flown through.

    The airway, its cavities and its openings are found by themselves; fly with
    paravol train --case DIR.

    Parameters
    ----------
    scan
        A DICOM folder, or an NRRD, NIfTI or MetaImage file.
    """
    from paravol.cases.case_import import import_case

    with ProgressReporter() as stages:
        imported = import_case(scan, options, stages)
    _print_report(options, imported, as_json=json)
    return 0


def _print_report(
    options: ImportOptions, imported: "ImportedCase", *, as_json: bool
) -> None:
    head, record, quality = imported.head, imported.record, imported.quality
    nz, ny, nx = head.ct.shape
    nostrils = {
        name: mark.position_mm
        for name, mark in head.landmarks.items()
        if name.startswith("nostril")
    }
    if as_json:
        print_json(
            {
                "folder": str(options.out),
                "shape": [nz, ny, nx],
                "spacing_mm": head.spacing_mm,
                "nostrils": {n: p.tolist() for n, p in nostrils.items()},
                "registration": quality or None,
                **msgspec.to_builtins(record),
            }
        )
        return
    rows = [
        ("scan", f"{record.sources[0].modality} {record.sources[0].name}"),
        ("case", f"{nx} x {ny} x {nz} voxels of {head.spacing_mm:g} mm"),
        ("airway", f"{head.airways.airway_ml:.1f} mL"),
        ("sinuses", _sinuses(head)),
        ("not named", _cavities(head)),
        ("leak check", _openings(head)),
        ("levels", _levels(record)),
        ("nostrils", "; ".join(f"{n} {_place(p)}" for n, p in nostrils.items()) or "-"),
        ("entrance", _entrance(head)),
        ("hazards", _hazards(record)),
    ]
    if quality:
        rows.append(("registration", ", ".join(f"{k} {v}" for k, v in quality.items())))
    rows += [("quality", line) for line in quality_lines(record)]
    rows += [("note", note) for note in head.notes]
    print_table(str(options.out), rows)
    print(f"Look at it with: paravol slices {options.out}")
    if head.approach is not None:
        print(f"Fly through it with: paravol train --case {options.out}")


def _cavities(head: "ImportedHead") -> str:
    spaces = [s for s in head.named.sinuses if not s.name]
    if not spaces:
        return "none"
    largest = ", ".join(
        f"{s.volume_ml:.1f} {s.side.name.lower()}{'' if s.is_open else ' (closed)'}"
        for s in spaces[:LISTED_CAVITIES]
    )
    more = "" if len(spaces) <= LISTED_CAVITIES else ", ..."
    return f"{len(spaces)}, mL: {largest}{more}"


def _sinuses(head: "ImportedHead") -> str:
    """List the named sinuses with their volumes, and how sure the names are."""
    listed = ", ".join(
        f"{s} {s.volume_ml:.1f}{'' if s.is_open else ' (closed)'}"
        for s in head.named.sinuses
        if s.name
    )
    return f"mL: {listed}; {head.named.confidence}" if listed else "none"


def _openings(head: "ImportedHead") -> str:
    """Describe where the airway meets the room: at the nostrils, or elsewhere too."""
    openings = [o for o in head.airways.openings if o.area_mm2 >= LISTED_OPENING_MM2]
    if not openings:
        return "the airway is closed to the room"
    listed = "; ".join(
        f"{o.area_mm2:.0f} mm2 at {_place(o.center_mm)}" for o in openings
    )
    return f"the airway meets the room over {listed}"


def _levels(record: "CaseRecord") -> str:
    """Describe the transfer function by the numbers that its nodes stand on."""
    assert record.transfer is not None
    return "nodes at " + ", ".join(f"{node:.0f}" for node in record.transfer.nodes)


def _hazards(record: "CaseRecord") -> str:
    names = [
        n.removeprefix("hazard ") for n in record.sha256 if n.startswith("hazard ")
    ]
    if not names:
        return "unknown (no labels): give a label map with --labels"
    return f"{', '.join(names)} (from {record.hazard_source})"


def _entrance(head: "ImportedHead") -> str:
    approach = head.approach
    if approach is None:
        return "none found: see the note"
    return f"{_place(approach.pivot_mm)}, free for {approach.free_mm:.0f} mm"


def _place(point: Iterable[float]) -> str:
    return "(" + ", ".join(f"{v:.1f}" for v in point) + ")"
