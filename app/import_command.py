"""`paravol import`: a patient's own scan as a case that can be flown through."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from anatomy.case import CaseRecord
from anatomy.imported import ImportedHead, import_head
from anatomy.imported_case import source_record, write_imported_case
from anatomy.scan import Modality, Scan, read_scan
from app.case_exercise import PATH, SCENARIO, exercise_of
from app.folder import claimed_folder
from app.terminal import Stages, print_json, print_table

LISTED_CAVITIES = 6


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


def run_import(options: ImportOptions, *, as_json: bool) -> int:
    """Import, write, tell what was found."""
    _refuse_foreign(options.out)
    with Stages() as stages:
        scan = _read(options, stages)
        pivot = None if options.pivot_mm is None else np.array(options.pivot_mm)
        head = import_head(scan, options.spacing_mm, stages, pivot)
        sources = [source_record(scan, options.scan.resolve().name)]
        others = {}
        quality: dict[str, Any] = {}
        if options.second is not None:
            from app.second_scan import add_second

            second = add_second(head, scan, options.second, stages)
            sources.append(second.source)
            others["mr"] = second.on_grid
            quality = second.quality
        with claimed_folder(options.out) as out:
            stages("Writing the case", 0.0)
            for old in (SCENARIO, PATH):
                (out / old).unlink(missing_ok=True)
            record = write_imported_case(head, tuple(sources), out, others)
            exercise_of(out)
            (out / ".lock").unlink(missing_ok=True)
            stages("Writing the case", 1.0)
    _tell(options, head, record, quality, as_json=as_json)
    return 0


def _read(options: ImportOptions, stages: Stages) -> Scan:
    modality = None if options.modality is None else Modality(options.modality.upper())
    return read_scan(
        options.scan,
        series=options.series,
        modality=modality,
        allow_gaps=options.allow_gaps,
        nonfinite_is_air=options.nonfinite_air,
        progress=stages,
    )


def _refuse_foreign(out: Path) -> None:
    """Write over a case, and over nothing else."""
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file; name a folder for the case with --out.")
    if out.is_dir() and any(out.iterdir()) and not (out / "case.json").exists():
        raise ValueError(
            f"{out} holds something that is no case; choose another folder with --out."
        )


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
    approach = head.approach
    rows = [
        ("scan", f"{record.sources[0].modality} {record.sources[0].name}"),
        ("case", f"{nx} x {ny} x {nz} voxels of {head.spacing_mm:g} mm"),
        ("airway", f"{head.airways.airway_ml:.1f} mL"),
        ("cavities", _cavities(head)),
        ("nostrils", "; ".join(f"{n} {_place(p)}" for n, p in nostrils.items()) or "-"),
        (
            "entrance",
            f"{_place(approach.pivot_mm)}, free for {approach.free_mm:.0f} mm",
        ),
    ]
    if quality:
        rows.append(("registration", ", ".join(f"{k} {v}" for k, v in quality.items())))
    rows += [("note", note) for note in head.notes]
    print_table(str(options.out), rows)
    print(f"Fly through it with: paravol train --case {options.out} --input mouse")


def _cavities(head: ImportedHead) -> str:
    cavities = head.airways.cavities
    if not cavities:
        return "none apart from the airway"
    largest = ", ".join(f"{c.volume_ml:.1f}" for c in cavities[:LISTED_CAVITIES])
    more = "" if len(cavities) <= LISTED_CAVITIES else ", ..."
    return f"{len(cavities)}: {largest}{more} mL"


def _place(point: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    return "(" + ", ".join(f"{v:.1f}" for v in point) + ")"
