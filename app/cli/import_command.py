"""`paravol import`: a patient's own scan as a case that can be flown through."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from anatomy.case import Case, CaseRecord
from anatomy.scan.imported import ImportedHead, import_head
from anatomy.scan.imported_case import source_record, write_imported_case
from anatomy.scan.scan import Modality, Scan, read_scan
from app.cli.terminal import Stages, print_json, print_table
from paravol.case_scenario import scenario_of_case, straight_path
from paravol.output_folder import claimed_case, remove_exercise
from paravol.second_scan import check_second, lay_second

LISTED_CAVITIES = 6

LISTED_OPENING_MM2 = 5.0
"""Smaller ones are a voxel or two."""


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """Hold what the command line asked for; see `paravol import --help`."""

    scan: Path
    out: Path
    series: int | None
    modality: str | None
    spacing_mm: float
    pivot_mm: tuple[float, float, float] | None
    second: Path | None
    allow_gaps: bool
    nonfinite_air: bool
    force: bool = False


def run_import(options: ImportOptions, *, as_json: bool) -> int:
    """Import, write, tell what was found."""
    with Stages() as stages, claimed_case(options.out, force=options.force) as out:
        scan, second = _read(options, stages)
        pivot = None if options.pivot_mm is None else np.array(options.pivot_mm)
        head = import_head(scan, options.spacing_mm, stages, pivot)
        if head.approach is not None:
            straight_path(head.approach, head.distance)  # refused before it is written
        sources = [source_record(scan, options.scan.resolve().name)]
        others = {}
        quality: dict[str, Any] = {}
        if options.second is not None and second is not None:
            laid = lay_second(head, scan, second, stages)
            sources.append(source_record(second, options.second.resolve().name))
            others["mr"] = laid.on_grid
            quality = laid.quality
        stages("Writing the case", 0.0)
        remove_exercise(out)
        record = write_imported_case(head, tuple(sources), out, others)
        if head.approach is not None:
            volumes = {"ct": head.ct, "distance": head.distance}
            scenario_of_case(out, Case(volumes, head.landmarks, record))
        stages("Writing the case", 1.0)
    _tell(options, head, record, quality, as_json=as_json)
    return 0


def _read(options: ImportOptions, stages: Stages) -> tuple[Scan, Scan | None]:
    """Read both scans first: nobody wants to hear later that the second is none."""
    read = partial(
        read_scan,
        allow_gaps=options.allow_gaps,
        nonfinite_is_air=options.nonfinite_air,
        progress=stages,
    )
    modality = None if options.modality is None else Modality(options.modality.upper())
    first = read(options.scan, series=options.series, modality=modality)
    second = None if options.second is None else read(options.second)
    if second is not None:
        check_second(first, second)
    return first, second


def _tell(
    options: ImportOptions,
    head: ImportedHead,
    record: CaseRecord,
    quality: dict[str, Any],
    *,
    as_json: bool,
) -> None:
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
        ("cavities", _cavities(head)),
        ("leak check", _openings(head)),
        ("levels", _levels(record)),
        ("nostrils", "; ".join(f"{n} {_place(p)}" for n, p in nostrils.items()) or "-"),
        ("entrance", _entrance(head)),
    ]
    if quality:
        rows.append(("registration", ", ".join(f"{k} {v}" for k, v in quality.items())))
    rows += [("note", note) for note in head.notes]
    print_table(str(options.out), rows)
    print(f"Look at it with: paravol slices {options.out}")
    if head.approach is not None:
        print(f"Fly through it with: paravol train --case {options.out}")


def _cavities(head: ImportedHead) -> str:
    chambers = head.spaces.chambers
    if not chambers:
        return "none apart from the airway"
    largest = ", ".join(
        f"{c.volume_ml:.1f} {c.side.name.lower()}{'' if c.is_open else ' (closed)'}"
        for c in chambers[:LISTED_CAVITIES]
    )
    more = "" if len(chambers) <= LISTED_CAVITIES else ", ..."
    return f"{len(chambers)}, mL: {largest}{more}"


def _openings(head: ImportedHead) -> str:
    """Say where the airway meets the room: at the nostrils, or elsewhere as well."""
    openings = [o for o in head.airways.openings if o.area_mm2 >= LISTED_OPENING_MM2]
    if not openings:
        return "the airway is closed to the room"
    listed = "; ".join(
        f"{o.area_mm2:.0f} mm2 at {_place(o.center_mm)}" for o in openings
    )
    return f"the airway meets the room over {listed}"


def _levels(record: CaseRecord) -> str:
    """Describe the transfer function by the numbers that its nodes stand on."""
    assert record.transfer is not None
    return "nodes at " + ", ".join(f"{node:.0f}" for node in record.transfer.nodes)


def _entrance(head: ImportedHead) -> str:
    approach = head.approach
    if approach is None:
        return "none found: see the note"
    return f"{_place(approach.pivot_mm)}, free for {approach.free_mm:.0f} mm"


def _place(point: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    return "(" + ", ".join(f"{v:.1f}" for v in point) + ")"
