"""Labels of a scan from a segmentation program: read, checked, measured as hazards.

3D Slicer's ``.seg.nrrd`` carries the segments' names in its header, a segmentation of
DICOM with its segments, and a NIfTI of TotalSegmentator in an XML extension; its folder
of masks has them in the files' names. Other label maps need their names beside them.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from anatomy.files.nifti import opened
from anatomy.files.volumes import as_image, load_layers
from anatomy.hazard_volumes import FARTHEST_MM, UNIT_MM, HazardVolumes
from anatomy.redistance import signed_distance
from anatomy.scan.dicom_segments import read_segments
from anatomy.scan.label_names import HAZARDS, TASKS, hazard_of
from anatomy.scan.scan import patient_box
from renderers.scene.volume import Volume
from system import UserError, simple_itk

MOST_HEADER_BYTES = 1 << 20

MOST_IN_AIR = 0.3
"""Share of a hazard's voxels that may lie in air before the labels do not fit."""

AIR_HU = -500.0

SAME_PLACE_MM = 1.0
"""Grids of equal size whose corners lie further apart are in different frames."""

MASKS = (".nii", ".gz", ".nrrd", ".seg", ".mha", ".mhd")
"""Endings of files in a folder of masks; what goes before them is a name."""

SAME_GRID = 1e-3

Names = tuple[str, ...]

_SEGMENT = re.compile(r"Segment(\d+)_(Name|LabelValue|Layer)$")
_XML_LABEL = re.compile(
    r'<Label\s+Key="(\d+)"[^>]*>\s*(?:<!\[CDATA\[)?([^<\]]+)', re.IGNORECASE
)


@dataclass(frozen=True, slots=True)
class LabelMap:
    """A label map: whole numbers in LPS, and the names of the values.

    names: of the segments that a value stands for; several where segments overlap.
    unread: names of masks that were not read, for no hazard is called so.
    """

    volume: Volume
    names: Mapping[int, tuple[str, ...]]
    source: str
    unread: tuple[str, ...] = ()

    def hazards(self) -> dict[str, list[int]]:
        """Return the values of the labels of each hazard that there are voxels of."""
        there = set(np.unique(self.volume.values).tolist())
        found: dict[str, list[int]] = {}
        for value, names in sorted(self.names.items()):
            hazards = {hazard for name in names if (hazard := hazard_of(name))}
            for hazard in sorted(hazards if value in there else ()):
                found.setdefault(hazard, []).append(value)
        return found

    def notes(self) -> list[str]:
        """Say which names nobody knows, and which values have none."""
        there = set(np.unique(self.volume.values).tolist()) - {0}
        named = {n for v, names in self.names.items() if v in there for n in names}
        unknown = sorted(n for n in {*named, *self.unread} if hazard_of(n) is None)
        notes = []
        if unknown:
            notes.append(
                f"labels that no structure is known by were left out: "
                f"{', '.join(unknown)}; rename those that must be kept clear of to one "
                f"of {', '.join(HAZARDS)}"
            )
        nameless = sorted(there - self.names.keys())
        if nameless:
            notes.append(
                f"label values without a name were left out: "
                f"{', '.join(map(str, nameless[:9]))}"
            )
        return notes


def read_labels(path: Path, names: str | None = None) -> LabelMap:
    """Read a label map: ``.seg.nrrd``, DICOM SEG, NRRD, NIfTI, MetaImage; or masks.

    names: a task of `TASKS`, or a JSON file of names: nnU-Net's ``dataset.json``, or
    one object of values and names; None takes those that the file carries. Raise
    UserError for what is no label map, or where no name is known.
    """
    if path.is_dir():
        return _masks(path)
    segments = read_segments(path, lambda name: bool(hazard_of(name)))
    if segments is not None:
        return _of_masks(path, *segments)
    layers = load_layers(path, background=0.0)
    for layer in layers:
        values = np.asarray(layer.values)
        if values.dtype.kind == "f" and not np.array_equal(values, np.rint(values)):
            raise UserError(
                f"{path} holds fractions, so it is no label map; give the segmentation "
                "itself, not a scan or a probability"
            )
    if len(layers) > 1:
        return _overlapping(path.name, layers, _named_segments(path))
    volume = layers[0].with_values(layers[0].values.astype(np.int32), 0.0)
    found = _given(names) if names else _carried(path)
    if not found:
        raise UserError(
            f"{path} does not say what its labels are; name them with --label-names: "
            f"{', '.join(TASKS)}, or a JSON file such as nnU-Net's dataset.json"
        )
    return LabelMap(volume, found, path.name)


def check_labels(labels: LabelMap, scan: Volume) -> None:
    """Refuse labels that are not of this scan, or hold no hazard."""
    hazards = labels.hazards()
    if not hazards:
        names = {name for held in labels.names.values() for name in held}
        known = ", ".join(sorted(names)) or "none"
        raise UserError(
            f"{labels.source} labels nothing that must be kept clear of; its names are "
            f"{known}. Hazards are known by names such as {', '.join(HAZARDS)}"
        )
    grid = labels.volume
    if grid.shape == scan.shape:
        # files may count slices from either end: the box that they fill is the same
        apart = np.subtract(patient_box(grid), patient_box(scan))
        if np.abs(apart).max() > SAME_PLACE_MM:
            raise UserError(
                f"{labels.source} has the scan's {scan.shape[2]} x {scan.shape[1]} x "
                f"{scan.shape[0]} voxels but lies {np.abs(apart).max():.0f} mm away or "
                "is flipped: its frame is another one; export the labels with the "
                "scan's geometry"
            )
    values = [value for held in hazards.values() for value in held]
    marked = np.argwhere(np.isin(grid.values, values))[:, ::-1]
    if len(marked) > 200_000:
        marked = marked[:: len(marked) // 200_000 + 1]
    matrix = grid.world_from_voxel
    places = marked @ matrix[:3, :3].T + matrix[:3, 3]
    back = scan.voxel_from_world
    voxels = np.rint(places @ back[:3, :3].T + back[:3, 3]).astype(np.intp)
    inside = np.all((voxels >= 0) & (voxels < scan.shape[::-1]), axis=1)
    if not inside.any():
        low, high = places.min(axis=0).round(), places.max(axis=0).round()
        raise UserError(
            f"{labels.source} does not overlap the scan: its hazards lie between "
            f"{low.tolist()} and {high.tolist()} mm (LPS); give the labels of this scan"
        )
    i, j, k = voxels[inside].T
    in_air = float(np.mean(np.asarray(scan.values)[k, j, i] < AIR_HU))
    if in_air > MOST_IN_AIR:
        raise UserError(
            f"{labels.source} does not fit the scan: {in_air:.0%} of its hazards lie "
            "in air; give the labels of this scan, in its frame"
        )


def hazards_from_labels(labels: LabelMap, grid: Volume) -> HazardVolumes:
    """Measure the labelled hazards on the grid of a head.

    Labels are taken from the nearest voxel; the distance is that to the staircase of
    their voxels, so it is off by up to half a voxel of the label map.
    """
    sitk = simple_itk()
    nearest = sitk.Resample(
        as_image(labels.volume),
        list(grid.shape[::-1]),
        sitk.Transform(),
        sitk.sitkNearestNeighbor,
        grid.origin_mm.tolist(),
        grid.spacing_mm.tolist(),
        grid.direction.ravel().tolist(),
    )
    values = sitk.GetArrayFromImage(nearest)
    spacing = float(grid.spacing_mm[0])
    volumes = {}
    for name, held in labels.hazards().items():
        field = np.where(np.isin(values, held), np.float32(-0.5), np.float32(0.5))
        distance = signed_distance(field, spacing, FARTHEST_MM, FARTHEST_MM)
        steps = np.rint(distance / np.float32(UNIT_MM)).astype(np.int16)
        volumes[name] = grid.with_values(steps, FARTHEST_MM / UNIT_MM)
    return HazardVolumes(volumes, labels.source)


def _given(names: str) -> dict[int, Names]:
    if names in TASKS:
        return {value: (name,) for value, name in enumerate(TASKS[names], start=1)}
    try:
        content = json.loads(Path(names).read_bytes())
    except (OSError, ValueError) as error:
        raise UserError(
            f"--label-names {names} is neither a known task ({', '.join(TASKS)}) nor a "
            "JSON file that can be read"
        ) from error
    if isinstance(content, dict) and isinstance(content.get("labels"), dict):
        content = content["labels"]
    found: dict[int, Names] = {}
    for key, value in content.items() if isinstance(content, dict) else ():
        if isinstance(value, str) and key.isdecimal():
            found[int(key)] = (value,)
            continue
        # nnU-Net 2: name first; a region has several values, and shares them
        for each in value if isinstance(value, list) else [value]:
            if isinstance(each, int):
                found[each] = (*found.get(each, ()), str(key))
    if not found:
        raise UserError(
            f'{names} names no labels; it must read {{"1": "orbit", ...}} or '
            '{"labels": {"orbit": 1, ...}}'
        )
    return found


def _carried(path: Path) -> dict[int, Names]:
    """Read the names that the file itself carries."""
    lower = path.name.lower()
    if lower.endswith((".nrrd", ".nhdr")):
        return {value: (name,) for _, value, name in _named_segments(path)}
    if lower.endswith((".nii", ".nii.gz")):
        with opened(path) as file:
            header = file.read(MOST_HEADER_BYTES)
        start = 540 if header[:4] in (b"\x1c\x02\0\0", b"\0\0\x02\x1c") else 348
        offset = header.find(b"</LabelTable>", start)
        text = header[start : max(offset, 0)].decode("utf-8", "replace")
        return {int(key): (name.strip(),) for key, name in _XML_LABEL.findall(text)}
    return {}


def _masks(folder: Path) -> LabelMap:
    """Read a folder of masks, as TotalSegmentator writes them; the rest is left out."""
    files, unread = {}, []
    for file in sorted(folder.iterdir()):
        name, ending = file.name, ""
        while Path(name).suffix.lower() in MASKS:
            name, ending = Path(name).stem, Path(name).suffix
        if not ending or name.startswith("."):
            continue
        if hazard_of(name):
            files[name] = file
        else:
            unread.append(name)
    masks: dict[str, Volume] = {}
    for name, file in files.items():
        (layer, *_) = load_layers(file, background=0.0)
        first = next(iter(masks.values()), layer)
        if layer.shape != first.shape or not np.allclose(
            layer.world_from_voxel, first.world_from_voxel, atol=SAME_GRID
        ):
            raise UserError(f"{file} lies on another grid than the masks beside it")
        mask = (np.asarray(layer.values) > 0.5).astype(np.uint8)
        masks[name] = layer.with_values(mask, 0.0)
    return _of_masks(folder, masks, unread)


def _of_masks(path: Path, masks: Mapping[str, Volume], unread: list[str]) -> LabelMap:
    """Put masks of one grid into a label map."""
    if not masks:
        raise UserError(
            f"{path} holds no mask of what must be kept clear of; hazards are known "
            f"by names such as {', '.join(HAZARDS)}, each a file such as "
            "optic_nerve_left.nii.gz, or a segment"
        )
    segments = [(number, 1, name) for number, name in enumerate(masks)]
    found = _overlapping(path.name, tuple(masks.values()), segments)
    return replace(found, unread=tuple(unread))


def _overlapping(
    source: str, layers: tuple[Volume, ...], segments: list[tuple[int, int, str]]
) -> LabelMap:
    """Give every set of segments that share a voxel a value of its own.

    segments: layer, value there, and name.
    """
    arrays = [layer.values.astype(np.int64) for layer in layers]
    codes = np.zeros(layers[0].shape, np.int64)
    for array in arrays:
        # few values a layer: each code is a row of them
        known, rank = np.unique(array, return_inverse=True)
        codes = codes * len(known) + rank.reshape(codes.shape)
        codes = np.unique(codes, return_inverse=True)[1].reshape(codes.shape)
    first = np.unique(codes, return_index=True)[1]
    found = {}
    for code, at in enumerate(first):
        here = {(n, int(array.flat[at])) for n, array in enumerate(arrays)}
        # 0 is what stands for nothing
        found[code + 1] = tuple(
            name for layer, value, name in segments if (layer, value) in here
        )
    found = {value: names for value, names in found.items() if names}
    if not found:
        raise UserError(
            f"{source} holds {len(layers)} layers and does not name their segments; "
            "save it from 3D Slicer as a segmentation, .seg.nrrd"
        )
    named = np.zeros(len(first) + 1, np.int32)
    named[list(found)] = list(found)
    return LabelMap(layers[0].with_values(named[codes + 1], 0.0), found, source)


def _named_segments(path: Path) -> list[tuple[int, int, str]]:
    """Return layer, value and name of each segment that a NRRD's header tells of."""
    with path.open("rb") as file:
        header = file.read(MOST_HEADER_BYTES).partition(b"\n\n")[0]
    fields: dict[str, dict[str, str]] = {}
    for line in header.decode("utf-8", "replace").splitlines():
        key, separator, value = line.partition(":=")
        match = _SEGMENT.match(key.strip())
        if separator and match:
            fields.setdefault(match[1], {})[match[2]] = value.strip()
    found = []
    for segment in fields.values():
        value, layer = segment.get("LabelValue", ""), segment.get("Layer", "0")
        if value.isdecimal() and layer.isdecimal() and "Name" in segment:
            found.append((int(layer), int(value), segment["Name"]))
    return found
