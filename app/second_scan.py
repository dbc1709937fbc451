"""A second scan of the same head, laid onto the first."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from anatomy.case import SourceRecord
from anatomy.imported import ImportedHead
from anatomy.imported_case import source_record
from anatomy.scan import Modality, Scan, read_scan
from anatomy.volume_registration import register_volumes, resampled
from app.operating_room import Progress
from renderers.scene import Volume


@dataclass(frozen=True, slots=True)
class SecondScan:
    """Hold the second scan on the head's grid and how well it fits.

    quality: figures by name, rounded for a person.
    """

    on_grid: Volume
    source: SourceRecord
    quality: dict[str, Any]


def add_second(
    head: ImportedHead, first: Scan, path: Path, progress: Progress
) -> SecondScan:
    """Read an MR and register it to the CT that the head was made of.

    Raises ValueError when it is no MR, the head is no CT, or they do not fit.
    """
    second = read_scan(path, progress=progress)
    if (first.modality, second.modality) != (Modality.CT, Modality.MR):
        raise ValueError(
            f"a second scan is an MR laid onto a CT; got {second.modality.value} onto "
            f"{first.modality.value}: name the CT first"
        )
    found = register_volumes(first.volume, second.volume, progress)
    quality = {
        "return_mm": round(found.return_mm, 2),
        "shared": round(found.shared, 3),
        "overlap": round(found.overlap, 3),
    }
    source = source_record(second, path.resolve().name)
    return SecondScan(resampled(second.volume, found, head.ct), source, quality)
