"""A patient as a folder: CT, labels, landmarks and where they come from.

``ct.nrrd``, ``labels.seg.nrrd``, ``landmarks.mrk.json`` and ``case.json``; 3D Slicer
opens the first three.
"""

import colorsys
import hashlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np

from anatomy.files import load_volume, save_volume
from anatomy.landmarks import Landmark
from anatomy.parameters import PhantomParameters
from anatomy.phantom import Phantom
from anatomy.resonance import magnetic_resonance
from anatomy.tissue import Label, Side
from renderers.scene.volume import Volume

SCHEMA_VERSION = 1
_T = TypeVar("_T")


class CaseRecord(msgspec.Struct, frozen=True, kw_only=True):
    """Hold what ``case.json`` says: the phantom's parameters and hashes of arrays."""

    schema_version: int
    spacing_mm: float
    parameters: PhantomParameters | None
    sha256: dict[str, str]


class _ControlPoint(msgspec.Struct, kw_only=True):
    id: str
    label: str
    position: tuple[float, float, float]
    description: str = ""


class _Markup(msgspec.Struct, kw_only=True, rename="camel"):
    type: str
    coordinate_system: str
    control_points: list[_ControlPoint]


class _Markups(msgspec.Struct, kw_only=True):
    schema: str = msgspec.field(name="@schema")
    markups: list[_Markup]


_MARKUPS_SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/"
    "Markups/Resources/Schema/markups-schema-v1.0.3.json#"
)


class _Extent(msgspec.Struct, kw_only=True):
    side: str
    radius_mm: float


@dataclass(frozen=True, slots=True)
class Case:
    """Hold a patient as read from a folder."""

    ct: Volume
    labels: Volume
    landmarks: dict[str, Landmark]
    record: CaseRecord


def write_case(phantom: Phantom, folder: Path | str) -> None:
    """Write a phantom as a case folder, each file atomically."""
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    save_volume(phantom.ct, target / "ct.nrrd")
    save_volume(
        phantom.labels, target / "labels.seg.nrrd", _segment_fields(phantom.labels)
    )
    points = [
        _ControlPoint(
            id=str(i + 1),
            label=landmark.name,
            position=(
                float(landmark.position_mm[0]),
                float(landmark.position_mm[1]),
                float(landmark.position_mm[2]),
            ),
            description=msgspec.json.encode(
                _Extent(side=landmark.side.name, radius_mm=landmark.radius_mm)
            ).decode(),
        )
        for i, landmark in enumerate(phantom.landmarks.values())
    ]
    markup = _Markup(type="Fiducial", coordinate_system="LPS", control_points=points)
    markups = _Markups(schema=_MARKUPS_SCHEMA, markups=[markup])
    _write(target / "landmarks.mrk.json", msgspec.json.encode(markups))
    record = CaseRecord(
        schema_version=SCHEMA_VERSION,
        spacing_mm=phantom.spacing_mm,
        parameters=phantom.parameters,
        sha256={"ct": _hash(phantom.ct), "labels": _hash(phantom.labels)},
    )
    _write(target / "case.json", msgspec.json.encode(record))


def write_resonance(phantom: Phantom, folder: Path | str) -> None:
    """Add ``t1.nrrd`` and ``t2.nrrd`` to a case folder."""
    for name, volume in zip(("t1", "t2"), magnetic_resonance(phantom), strict=True):
        save_volume(volume, Path(folder) / f"{name}.nrrd")


def read_case(folder: Path | str) -> Case:
    """Read a case folder.

    Raise ValueError naming the file that is missing, unreadable, or changed since
    the case was written.
    """
    source = Path(folder)
    record = _decode(source / "case.json", CaseRecord)
    if record.schema_version != SCHEMA_VERSION:
        raise ValueError(
            f"{source / 'case.json'} has schema version {record.schema_version}; this "
            f"program reads {SCHEMA_VERSION}"
        )
    ct = load_volume(source / "ct.nrrd")
    labels = load_volume(source / "labels.seg.nrrd", background=0.0)
    for name, volume in (("ct", ct), ("labels", labels)):
        if record.sha256.get(name) != _hash(volume):
            raise ValueError(
                f"{source} holds a {name} volume that is not the one case.json names"
            )
    path = source / "landmarks.mrk.json"
    found: dict[str, Landmark] = {}
    for markup in _decode(path, _Markups).markups:
        if markup.coordinate_system != "LPS":
            raise ValueError(f"{path} must be in LPS, got {markup.coordinate_system}")
        for point in markup.control_points:
            extent = msgspec.json.decode(point.description, type=_Extent)
            landmark = Landmark(
                point.label,
                Side[extent.side],
                np.array(point.position),
                extent.radius_mm,
            )
            found[landmark.key] = landmark
    return Case(ct, labels, found, record)


def _segment_fields(labels: Volume) -> dict[str, str]:
    """Name the labels in use the way 3D Slicer's segmentations do."""
    fields = {"Segmentation_MasterRepresentation": "Binary labelmap"}
    for i, value in enumerate(v for v in np.unique(labels.values) if v != 0):
        red, green, blue = colorsys.hsv_to_rgb(i * 0.618 % 1.0, 0.55, 0.9)
        fields |= {
            f"Segment{i}_ID": f"Segment_{value}",
            f"Segment{i}_Name": Label(value).name.lower().replace("_", " "),
            f"Segment{i}_LabelValue": str(value),
            f"Segment{i}_Layer": "0",
            f"Segment{i}_Color": f"{red:.3f} {green:.3f} {blue:.3f}",
        }
    return fields


def _hash(volume: Volume) -> str:
    return hashlib.sha256(volume.values.tobytes()).hexdigest()


def _decode(path: Path, kind: type[_T]) -> _T:
    try:
        return msgspec.json.decode(path.read_bytes(), type=kind)
    except FileNotFoundError as error:
        raise ValueError(f"there is no file {path}") from error
    except msgspec.DecodeError as error:
        raise ValueError(f"{path} is not a valid case file: {error}") from error


def _write(path: Path, content: bytes) -> None:
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content + b"\n")
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
