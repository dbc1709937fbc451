"""A patient as a folder: volumes, labels, landmarks and where they come from.

``ct.nrrd``, ``labels.seg.nrrd`` and ``landmarks.mrk.json`` open in 3D Slicer, and so do
the volumes that a flight needs: ``distance.nrrd``, ``blood.nrrd``, ``skin.nrrd``; a
second scan on the same grid is ``mr.nrrd``, a phantom's are ``t1.nrrd`` and
``t2.nrrd``. ``face.nrrd`` is the distance to the skin of the whole head, on a coarser
grid. ``walls.nrrd`` and ``ground.nrrd`` say what lies behind the surface of the air,
with a table in ``case.json``; ``hazard-orbit.nrrd`` and others like it are distances in
hundredths of a millimetre, negative inside. ``case.json`` names all with their hashes.
It is removed first and written last: a folder without it is no case.
"""

import hashlib
import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from anatomy.abstract import LABELS, AbstractSpace
from anatomy.files.markups import read_markups, write_markups
from anatomy.files.segments import segment_fields
from anatomy.files.volumes import load_volume, save_volume, write_file
from anatomy.hazard_volumes import FARTHEST_MM as HAZARD_MM
from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from anatomy.phantom.parameters import Opacity, PhantomParameters
from anatomy.phantom.phantom import Phantom, head_skin
from anatomy.phantom.synthetic_mr import magnetic_resonance
from anatomy.queries.landmarks import Landmark
from anatomy.queries.lund_mackay import lund_mackay, trapped_sinuses
from anatomy.redistance import DEEPEST_MM, FARTHEST_MM
from anatomy.scan.face_points import FACE_RADIUS_MM, face_points
from anatomy.scan.histogram import find_peaks, transfer_of
from anatomy.tissue import Label, Side
from anatomy.wall_layers import NO_WALL, WallKind, WallLayers
from renderers.scene.transfer import TransferFunction
from renderers.scene.volume import AIR_HU, Volume
from system import UserError
from system.typed_record import decode_json

SCHEMA_VERSION = 1

WALLS, GROUND = "walls", "ground"

FRAMED, FRAME_MM = ("ct", "face"), 1e-4
"""Volumes with a grid of their own, and how far apart frames may be: all others share
the ct's."""

_HAZARD = "hazard "
_HAZARD_NAME = re.compile(r"hazard [a-z][a-z ]{0,40}")

FILES = {
    "ct": ("ct.nrrd", AIR_HU),
    "labels": ("labels.seg.nrrd", 0.0),
    "distance": ("distance.nrrd", FARTHEST_MM),
    "blood": ("blood.nrrd", 0.0),
    "skin": ("skin.nrrd", 0.0),
    "mr": ("mr.nrrd", AIR_HU),
    "t1": ("t1.nrrd", 0.0),
    "t2": ("t2.nrrd", 0.0),
    "face": ("face.nrrd", DEEPEST_MM),
    WALLS: ("walls.nrrd", float(NO_WALL)),
    GROUND: ("ground.nrrd", 0.0),
}
"""Of each volume: its file and what lies outside it."""

FLOWN = "ct", "labels", "distance", "blood", "skin"
"""What a flight needs of every head and space."""

MARK_MM = 2.0
"""Radius in which a landmark of an abstract space is shown."""

RECORD, LANDMARKS = "case.json", "landmarks.mrk.json"

_T = TypeVar("_T")


class CavityRecord(msgspec.Struct, frozen=True, kw_only=True):
    """Name an air space beside the nasal passages; LPS mm, mL.

    side: right, left or midline. is_open: one air with the passages in the scan. name:
    of a sinus, "" where it has none. confidence: how it came to its name.
    """

    center_mm: tuple[float, float, float]
    volume_ml: float
    side: str = "midline"
    is_open: bool = False
    name: str = ""
    confidence: str = ""


class QualityRecord(msgspec.Struct, frozen=True, kw_only=True):
    """One thing about a scan; value: its figure, in the unit that `told` names.

    limits: what it takes away, "" where nothing.
    """

    name: str
    value: float
    told: str
    limits: str = ""


class OpeningRecord(msgspec.Struct, frozen=True, kw_only=True):
    """Where the airway meets the room; LPS mm."""

    center_mm: tuple[float, float, float]
    area_mm2: float


class TransferRecord(msgspec.Struct, frozen=True, kw_only=True):
    """The transfer function that fits the scan's histogram.

    nodes: CT numbers. color: linear RGB at each. kappa_per_mm: extinction at each.
    """

    nodes: tuple[float, ...]
    color: tuple[tuple[float, float, float], ...]
    kappa_per_mm: tuple[float, ...]

    @classmethod
    def of(cls, function: TransferFunction) -> "TransferRecord":
        """Put a function down."""
        return msgspec.convert(
            {
                "nodes": function.nodes.tolist(),
                "color": function.color.tolist(),
                "kappa_per_mm": function.kappa_per_mm.tolist(),
            },
            cls,
        )

    def function(self) -> TransferFunction:
        """Return the function; UserError where the numbers are none."""
        return TransferFunction(
            np.array(self.nodes), np.array(self.color), np.array(self.kappa_per_mm)
        )


class SourceRecord(msgspec.Struct, frozen=True, kw_only=True):
    """Which scan a case was made of, without its path or the patient's name.

    sha256: of the values, as they were read, and their grid.
    """

    name: str
    modality: str
    sha256: str
    notes: tuple[str, ...] = ()


class WallsRecord(msgspec.Struct, frozen=True, kw_only=True):
    """The table of `WallLayers`, row by row, and how the layers were found."""

    kinds: tuple[WallKind, ...]
    source: str
    uncertainty_mm: float = 0.0


class ApproachRecord(msgspec.Struct, frozen=True, kw_only=True):
    """Where a scope enters and where it points; LPS, mm."""

    pivot_mm: tuple[float, float, float]
    axis: tuple[float, float, float]
    free_mm: float


class DiseaseRecord(msgspec.Struct, frozen=True, kw_only=True):
    """What a phantom's volumes show of disease.

    right, left: Lund-Mackay scores recounted from the labels, with the polyps' grade
    asked for. trapped: sinuses whose air has no way to the nose.
    """

    right: Opacity
    left: Opacity
    trapped: tuple[str, ...] = ()

    @classmethod
    def of(cls, phantom: Phantom) -> "DiseaseRecord":
        """Recount a phantom; a diseased one is built once more without disease."""
        found = lund_mackay(phantom)
        right, left = (
            msgspec.structs.replace(
                found[side], polyps=phantom.parameters.opacity_of(side).polyps
            )
            for side in (Side.RIGHT, Side.LEFT)
        )
        return cls(right=right, left=left, trapped=trapped_sinuses(phantom))

    def sentences(self) -> tuple[str, ...]:
        """Tell the scores and what cannot drain, a line each."""
        total = self.right.total + self.left.total
        told = [
            f"Lund-Mackay score {total} of 24: right {self.right.total}, left "
            f"{self.left.total}"
        ]
        for name, held in (("right", self.right), ("left", self.left)):
            scores = {
                field.replace("_", " "): getattr(held, field)
                for field in held.__struct_fields__
            }
            if any(scores.values()):
                listed = ", ".join(f"{field} {n}" for field, n in scores.items() if n)
                told.append(f"{name}: {listed}")
        told += [f"the air of the {name} sinus cannot drain" for name in self.trapped]
        return tuple(told)


class CaseRecord(msgspec.Struct, frozen=True, kw_only=True):
    """What ``case.json`` says.

    label_names: by the labels' values in decimal.
    parameters: of a phantom. sources, notes, airway_ml, cavities, openings, approach:
    of a scan; the second source is the second volume. disease: of a phantom, where it
    was recounted. transfer: for mode `classic`.
    sha256: of each volume's values, by name. frames: of `FRAMED` volumes, the first
    three rows of `Volume.world_from_voxel`; none in older cases. walls: None where
    nobody knows what lies behind the surface. hazard_source: how the hazards were
    found, "" without any. quality: of the scan.
    """

    schema_version: int
    spacing_mm: float
    parameters: PhantomParameters | None
    sha256: dict[str, str]
    frames: dict[str, tuple[float, ...]] = {}
    sources: tuple[SourceRecord, ...] = ()
    notes: tuple[str, ...] = ()
    label_names: dict[str, str] = {}  # msgspec copies it for each record
    airway_ml: float | None = None
    cavities: tuple[CavityRecord, ...] = ()
    openings: tuple[OpeningRecord, ...] = ()
    approach: ApproachRecord | None = None
    transfer: TransferRecord | None = None
    walls: WallsRecord | None = None
    hazard_source: str = ""
    quality: tuple[QualityRecord, ...] = ()
    disease: DiseaseRecord | None = None


@dataclass(frozen=True, slots=True)
class Case:
    """A patient as read from a folder; volumes by the names of `FILES`.

    layers, hazards: None where the case has none.
    """

    volumes: Mapping[str, Volume]
    landmarks: dict[str, Landmark]
    record: CaseRecord
    layers: WallLayers | None = None
    hazards: HazardVolumes | None = None

    @property
    def ct(self) -> Volume:
        """Return the CT numbers."""
        return self.volumes["ct"]

    @property
    def labels(self) -> Volume:
        """Return what each voxel is."""
        return self.volumes["labels"]


def write_case(
    phantom: Phantom,
    folder: Path | str,
    *,
    resonance: bool = False,
    disease: DiseaseRecord | None = None,
) -> None:
    """Write a phantom as a case folder, each file atomically; resonance: T1, T2 too.

    disease: what `DiseaseRecord.of` found, to be told in the record. The skin of the
    whole head and places on the face come along, as an imported head has them.
    """
    face = head_skin(phantom.parameters)
    volumes = {name: getattr(phantom, name) for name in FLOWN} | {"face": face}
    if resonance:
        volumes["t1"], volumes["t2"] = magnetic_resonance(phantom)
    record = CaseRecord(
        schema_version=SCHEMA_VERSION,
        spacing_mm=phantom.spacing_mm,
        parameters=phantom.parameters,
        sha256={},
        transfer=TransferRecord.of(transfer_of(find_peaks(phantom.ct))),
        disease=disease,
    )
    nostril = phantom.landmarks["nostril, right"].position_mm
    marks = {
        name: Landmark(name, Side.MIDLINE, place, FACE_RADIUS_MM)
        for name, place in face_points(face, nostril).items()
    }
    marks = {**phantom.landmarks, **marks}
    store_case(
        Path(folder),
        volumes,
        names_of(phantom.labels),
        marks,
        record,
        layers=phantom.layers,
        hazards=phantom.hazards,
    )


def names_of(labels: Volume) -> dict[int, str]:
    """Name each `Label` that a volume of them holds, as label files do."""
    return {
        int(value): Label(value).name.lower().replace("_", " ")
        for value in np.unique(labels.values)
    }


def write_space(space: AbstractSpace, folder: Path | str) -> None:
    """Write an abstract space as a case folder, each file atomically."""
    way = space.way_in
    pivot, axis = (
        (float(x), float(y), float(z)) for x, y, z in (way.pivot_mm, way.axis)
    )
    store_case(
        Path(folder),
        {name: getattr(space, name) for name in FLOWN},
        {int(Label.NASAL_AIR): "air"} | {int(v): name for v, name in LABELS.items()},
        {
            name: Landmark(name, Side.MIDLINE, place, MARK_MM)
            for name, place in space.landmarks.items()
        },
        CaseRecord(
            schema_version=SCHEMA_VERSION,
            spacing_mm=float(space.ct.spacing_mm[0]),
            parameters=None,
            sha256={},
            approach=ApproachRecord(pivot_mm=pivot, axis=axis, free_mm=way.free_mm),
        ),
    )


def store_case(
    folder: Path,
    volumes: Mapping[str, Volume],
    label_names: Mapping[int, str],
    landmarks: Mapping[str, Landmark],
    record: CaseRecord,
    *,
    layers: WallLayers | None = None,
    hazards: HazardVolumes | None = None,
) -> CaseRecord:
    """Write a case; gives the record with hashes, walls and hazards filled in.

    A case that is there already stays as it is until the new one is whole. Raises
    OSError when the disk refuses.

    volumes: by the names of `FILES`. label_names: by the values of the labels; 0 is
    left out. layers, hazards: None for a head whose walls or hazards nobody knows.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    volumes = dict(volumes)
    if layers is not None:
        volumes |= {WALLS: layers.wall, GROUND: layers.ground}
        walls = WallsRecord(
            kinds=layers.kinds,
            source=layers.source,
            uncertainty_mm=layers.uncertainty_mm,
        )
        record = msgspec.structs.replace(record, walls=walls)
    if hazards is not None:
        volumes |= {_HAZARD + name: held for name, held in hazards.volumes.items()}
        record = msgspec.structs.replace(record, hazard_source=hazards.source)
    # in one order, so that what is read and written again is the same file
    hashes = {name: values_hash(volumes[name].values) for name in sorted(volumes)}
    finished = msgspec.structs.replace(
        record,
        sha256=hashes,
        frames={name: _frame(volumes[name]) for name in FRAMED if name in volumes},
        label_names={str(v): name for v, name in label_names.items() if v != 0},
    )
    with tempfile.TemporaryDirectory(dir=folder, prefix=".part-") as name:
        part = Path(name)
        for key, volume in volumes.items():
            is_named = key == "labels"
            fields = segment_fields(label_names, volume.shape) if is_named else None
            save_volume(volume, part / _file(key)[0], fields)
        write_markups(landmarks, part / LANDMARKS)
        write_file(part / RECORD, msgspec.json.encode(finished) + b"\n")
        # without its record a folder is no case
        (folder / RECORD).unlink(missing_ok=True)
        ours = [folder / file for file, _ in FILES.values()]
        for old in (*ours, *folder.glob("hazard-*.nrrd")):
            old.unlink(missing_ok=True)
        for file in sorted(part.iterdir(), key=lambda f: f.name == RECORD):
            file.replace(folder / file.name)
    return finished


def read_case(folder: Path | str) -> Case:
    """Read a case folder.

    Raise UserError naming the file that is missing, unreadable, or changed since
    the case was written.
    """
    source = Path(folder)
    record = _decode(source / RECORD, CaseRecord)
    if record.schema_version != SCHEMA_VERSION:
        raise UserError(
            f"{source / RECORD} has schema version {record.schema_version}; this "
            f"program reads {SCHEMA_VERSION}"
        )
    lacking = {"ct", "labels"} - record.sha256.keys()
    unknown = {
        name
        for name in record.sha256.keys() - FILES.keys()
        if not _HAZARD_NAME.fullmatch(name)
    }
    if lacking or unknown:
        raise UserError(
            f"{source / RECORD} must name ct and labels, and of others only "
            f"{', '.join(FILES)} and hazards; it names "
            f"{', '.join(sorted(record.sha256)) or 'none'}"
        )
    volumes = {}
    for name in record.sha256:
        file, background = _file(name)
        volume = load_volume(source / file, background=background)
        if record.sha256[name] != values_hash(volume.values):
            raise UserError(
                f"{source} holds a {name} volume that is not the one case.json names"
            )
        told = record.frames.get(name, _frame(volume))
        if len(told) != 12 or not np.allclose(told, _frame(volume), atol=FRAME_MM):
            raise UserError(
                f"{source / file} lies elsewhere in the patient, or has voxels of "
                "another size, than case.json says; import the scan again"
            )
        volumes[name] = volume
    grid = volumes["ct"]
    if any(
        v.shape != grid.shape
        or not np.allclose(v.world_from_voxel, grid.world_from_voxel, atol=FRAME_MM)
        for name, v in volumes.items()
        if name != "face"
    ):
        raise UserError(f"the volumes of {source} do not share one grid")
    layers, hazards = _layers(source, volumes, record), _hazards(volumes, record)
    others = {name: volumes[name] for name in volumes.keys() & FILES.keys()}
    return Case(others, read_markups(source / LANDMARKS), record, layers, hazards)


def _frame(volume: Volume) -> tuple[float, ...]:
    return tuple(volume.world_from_voxel[:3].ravel().tolist())


def _file(name: str) -> tuple[str, float]:
    """Return a volume's file and what lies outside it."""
    if name in FILES:
        return FILES[name]
    return f"{name.replace(' ', '-')}.nrrd", HAZARD_MM / UNIT_MM


def _layers(
    source: Path, volumes: Mapping[str, Volume], record: CaseRecord
) -> WallLayers | None:
    if record.walls is None or WALLS not in volumes or GROUND not in volumes:
        return None
    wall, kinds = volumes[WALLS], record.walls.kinds
    if wall.values.dtype != np.uint8 or int(wall.values.max()) >= len(kinds):
        raise UserError(
            f"{source / FILES[WALLS][0]} names wall {wall.values.max()}, but the table "
            f"in {RECORD} has {len(kinds)} rows; write the case again"
        )
    return WallLayers(
        wall,
        volumes[GROUND],
        kinds,
        record.walls.source,
        record.walls.uncertainty_mm,
    )


def _hazards(volumes: Mapping[str, Volume], record: CaseRecord) -> HazardVolumes | None:
    found = {
        name.removeprefix(_HAZARD): volume
        for name, volume in volumes.items()
        if name.startswith(_HAZARD)
    }
    return HazardVolumes(found, record.hazard_source) if found else None


def values_hash(values: NDArray[Any]) -> str:
    """Return the SHA-256 of an array's values in C order."""
    return hashlib.sha256(np.ascontiguousarray(values).data).hexdigest()


def _decode(path: Path, kind: type[_T]) -> _T:
    try:
        content = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError) as error:
        raise UserError(f"there is no file {path}") from error
    return decode_json(content, kind, path, "a case file")
