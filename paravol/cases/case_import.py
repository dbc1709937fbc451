"""A patient's own scan becomes a case that can be flown through."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from anatomy.case import Case, CaseRecord
from anatomy.scan.imported import ImportedHead, import_head
from anatomy.scan.imported_case import source_record, write_imported_case
from anatomy.scan.label_file import (
    LabelMap,
    check_labels,
    hazards_from_labels,
    read_labels,
)
from anatomy.scan.scan import Modality, Scan, read_scan
from anatomy.scan.scan_quality import scan_quality
from anatomy.scan.volume_registration import register_volumes, resampled
from anatomy.scan.wall_estimate import estimate_walls
from paravol.cases.case_options import ImportOptions
from paravol.exercises.case_scenario import scenario_of_case, straight_path
from paravol.output_folder import claimed_case, remove_exercise
from paravol.patient import Progress
from renderers.scene import Volume
from system import UserError
from system.plain_text import plain


@dataclass(frozen=True, slots=True)
class ImportedCase:
    """What was imported. quality: of the second scan's registration, if any."""

    head: ImportedHead
    record: CaseRecord
    quality: dict[str, float]


def import_case(file: Path, options: ImportOptions, progress: Progress) -> ImportedCase:
    """Read a scan, find its airway, write the case."""
    with claimed_case(options.out, force=options.force) as out:
        scan, second = _read(file, options, progress)
        labels = _labels(options, scan)
        pivot = None if options.pivot is None else np.array(options.pivot)
        head = import_head(scan, options.spacing, progress, pivot)
        if head.approach is not None:
            straight_path(head.approach, head.distance)  # refused before it is written
        sources = [source_record(scan, plain(file.resolve().name))]
        others = {}
        quality: dict[str, float] = {}
        if options.second is not None and second is not None:
            others["mr"], quality = _lay_second(head, scan, second, progress)
            name = plain(options.second.resolve().name)
            sources.append(source_record(second, name))
        hazards = None
        if labels is not None:
            progress("Measuring hazards", 0.0)
            hazards = hazards_from_labels(labels, head.ct)
            head = replace(head, notes=(*head.notes, *labels.notes()))
            progress("Measuring hazards", 1.0)
        layers = None
        if scan.modality is Modality.CT:
            progress("Estimating walls", 0.0)
            layers = estimate_walls(head.ct, head.distance, hazards)
            progress("Estimating walls", 1.0)
        progress("Writing the case", 0.0)
        record = write_imported_case(
            head,
            tuple(sources),
            out,
            others,
            quality=scan_quality(scan, head),
            layers=layers,
            hazards=hazards,
        )
        remove_exercise(out)
        if head.approach is not None:
            volumes = {"ct": head.ct, "distance": head.distance}
            scenario_of_case(out, Case(volumes, head.landmarks, record))
        progress("Writing the case", 1.0)
    return ImportedCase(head, record, quality)


def _labels(options: ImportOptions, scan: Scan) -> LabelMap | None:
    """Read the labels, where there are any, and refuse those of another scan."""
    if options.labels is None:
        if options.label_names is not None:
            raise UserError(
                f"--label-names {options.label_names} names the values of a label map; "
                "give the map with --labels"
            )
        return None
    labels = read_labels(options.labels, options.label_names)
    check_labels(labels, scan.volume)
    return labels


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
    if second is not None and (first.modality, second.modality) != (
        Modality.CT,
        Modality.MR,
    ):
        raise UserError(
            f"a second scan is an MR laid onto a CT; got {second.modality.value} onto "
            f"{first.modality.value}: name the CT first"
        )
    return first, second


def _lay_second(
    head: ImportedHead, first: Scan, second: Scan, progress: Progress
) -> tuple[Volume, dict[str, float]]:
    """Register an MR to the CT that the head was made of; UserError if it does not fit.

    Return it on the head's grid, and how well it fits: figures by name, rounded for a
    person.
    """
    found = register_volumes(first.volume, second.volume, progress)
    quality = {
        "return_mm": round(found.return_mm, 2),
        "shared": round(found.shared, 3),
        "overlap": round(found.overlap, 3),
    }
    return resampled(second.volume, found, head.ct), quality
