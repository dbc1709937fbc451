"""A head made from a scan, kept as a case folder."""

import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from anatomy.case import (
    FLOWN,
    SCHEMA_VERSION,
    ApproachRecord,
    CaseRecord,
    CavityRecord,
    OpeningRecord,
    QualityRecord,
    SourceRecord,
    TransferRecord,
    names_of,
    store_case,
)
from anatomy.hazard_volumes import HazardVolumes
from anatomy.scan.histogram import find_peaks, transfer_of
from anatomy.scan.imported import ImportedHead
from anatomy.scan.scan import Modality, Scan
from anatomy.wall_layers import WallLayers
from renderers.scene.volume import Volume

Triple = tuple[float, float, float]


def source_record(scan: Scan, name: str) -> SourceRecord:
    """Describe a scan; name: of its file or folder, without where it lies."""
    digest = hashlib.sha256(np.ascontiguousarray(scan.volume.values).data)
    digest.update(scan.volume.world_from_voxel.tobytes())
    return SourceRecord(
        name=name,
        modality=scan.modality.value,
        sha256=digest.hexdigest(),
        notes=scan.notes,
    )


def write_imported_case(
    head: ImportedHead,
    sources: tuple[SourceRecord, ...],
    folder: Path,
    others: Mapping[str, Volume] | None = None,
    *,
    quality: tuple[QualityRecord, ...] = (),
    layers: WallLayers | None = None,
    hazards: HazardVolumes | None = None,
) -> CaseRecord:
    """Write an imported head as a case; gives what ``case.json`` says.

    others: further volumes on the head's grid, by the names of `anatomy.case.FILES`.
    quality: of the scan. layers, hazards: None where they are unknown.
    """
    volumes = {name: getattr(head, name) for name in (*FLOWN, "face")}
    volumes |= others or {}
    airways, approach = head.airways, head.approach
    is_ct = sources[0].modality == Modality.CT.value
    transfer = transfer_of(find_peaks(head.ct, bone=is_ct))
    record = CaseRecord(
        schema_version=SCHEMA_VERSION,
        spacing_mm=head.spacing_mm,
        parameters=None,
        sha256={},
        sources=sources,
        notes=head.notes,
        airway_ml=airways.airway_ml,
        cavities=tuple(
            CavityRecord(
                center_mm=_triple(c.center_mm),
                volume_ml=c.volume_ml,
                side=c.side.name.lower(),
                is_open=c.is_open,
                name=c.name,
                confidence=head.named.confidence if c.name else "",
            )
            for c in head.named.sinuses
        ),
        openings=tuple(
            OpeningRecord(center_mm=_triple(o.center_mm), area_mm2=o.area_mm2)
            for o in airways.openings
        ),
        approach=None
        if approach is None
        else ApproachRecord(
            pivot_mm=_triple(approach.pivot_mm),
            axis=_triple(approach.axis),
            free_mm=approach.free_mm,
        ),
        transfer=TransferRecord.of(transfer),
        quality=quality,
    )
    return store_case(
        folder,
        volumes,
        names_of(head.labels),
        head.landmarks,
        record,
        layers=layers,
        hazards=hazards,
    )


def _triple(point: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Triple:
    x, y, z = (float(v) for v in point)
    return x, y, z
