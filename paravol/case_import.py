"""A patient's own scan becomes a case that can be flown through."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from anatomy.case import Case, CaseRecord
from anatomy.scan.imported import ImportedHead, import_head
from anatomy.scan.imported_case import source_record, write_imported_case
from anatomy.scan.scan import Modality, Scan, read_scan
from paravol.case_options import ImportOptions
from paravol.case_scenario import scenario_of_case, straight_path
from paravol.output_folder import claimed_case, remove_exercise
from paravol.patient import Progress
from paravol.second_scan import check_second, lay_second


@dataclass(frozen=True, slots=True)
class ImportedCase:
    """Hold what was imported. quality: of the second scan's registration, if any."""

    head: ImportedHead
    record: CaseRecord
    quality: dict[str, float]


def import_case(file: Path, options: ImportOptions, progress: Progress) -> ImportedCase:
    """Read a scan, find its airway, write the case."""
    with claimed_case(options.out, force=options.force) as out:
        scan, second = _read(file, options, progress)
        pivot = None if options.pivot is None else np.array(options.pivot)
        head = import_head(scan, options.spacing, progress, pivot)
        if head.approach is not None:
            straight_path(head.approach, head.distance)  # refused before it is written
        sources = [source_record(scan, file.resolve().name)]
        others = {}
        quality: dict[str, float] = {}
        if options.second is not None and second is not None:
            laid = lay_second(head, scan, second, progress)
            sources.append(source_record(second, options.second.resolve().name))
            others["mr"] = laid.on_grid
            quality = laid.quality
        progress("Writing the case", 0.0)
        remove_exercise(out)
        record = write_imported_case(head, tuple(sources), out, others)
        if head.approach is not None:
            volumes = {"ct": head.ct, "distance": head.distance}
            scenario_of_case(out, Case(volumes, head.landmarks, record))
        progress("Writing the case", 1.0)
    return ImportedCase(head, record, quality)


def _read(
    file: Path, options: ImportOptions, progress: Progress
) -> tuple[Scan, Scan | None]:
    """Read both scans first: nobody wants to hear later that the second is none."""
    read = partial(
        read_scan,
        allow_gaps=options.allow_gaps,
        nonfinite_is_air=options.nonfinite_air,
        progress=progress,
    )
    modality = None if options.modality is None else Modality(options.modality.upper())
    first = read(file, series=options.series, modality=modality)
    second = None if options.second is None else read(options.second)
    if second is not None:
        check_second(first, second)
    return first, second
