"""DICOM folders: which series there are, and one of them as a volume.

Nothing is guessed: a series that lacks a position, a size or a piece of a file is
refused with the file's name.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from anatomy.scan.dicom_folder import examination_files, is_dicom, read_dicom
from anatomy.scan.dicom_frames import (
    MANY_FRAMES,
    Frame,
    check_whole,
    frame_values,
    frames_of,
    has_many_frames,
    kind_of,
)
from anatomy.scan.dicom_segments import SEGMENTATIONS
from anatomy.scan.slice_stack import SAME_PLACE_MM, SliceStack, StackLayout, straighten
from renderers.scene.memory_limit import memory_limit
from renderers.scene.volume import AIR_HU, Volume
from system import UserError, foreign_file

if TYPE_CHECKING:
    from pydicom import Dataset

WORKING_BYTES = 12
"""For each pixel: it is held as a float, put into order, and resampled."""

FEWEST_SLICES = 5
"""A series of fewer is a scout image, not a volume."""

SAME_WAY = 1e-3
"""Largest difference of two orientations, by their cosines, that is rounding."""

SAME_SPACING_MM = 6e-4
"""Largest difference of two pixel spacings that is rounding, to three digits."""

SPARSE = 1.5
"""Steps of more thicknesses than this leave tissue out."""

LISTED_GAPS = 6

TRAITS = {
    "ConvolutionKernel": "kernel",
    "AcquisitionNumber": "acquisition",
    "EchoTime": "echo time",
    "TemporalPositionIdentifier": "phase",
    "NominalPercentageOfCardiacPhase": "phase",
    "ContrastBolusAgent": "contrast",
    "KVP": "kV",
    "ImageType": "kind",
    "AcquisitionTime": "time",
    "ContentTime": "time",
}
"""What may tell two pictures of one place apart, and how it is called."""

UID = "SOPInstanceUID"

Progress = Callable[[str, float], None]


@dataclass(slots=True)
class DicomSeries:
    """The slices of one series that share one geometry.

    axes: ``(6,)`` unit vectors along a row and along a column, LPS. spacing_mm: between
    rows, between columns. files, numbers: of each slice, its file and which of the
    file's frames it is, from 0. places_mm: of each, along the slices' normal; NaN where
    it is not told. traits: of each, by `TRAITS`. differs: by what a series was parted.
    """

    uid: str
    modality: str
    description: str
    rows: int
    columns: int
    axes: NDArray[np.float64]
    spacing_mm: NDArray[np.float64]
    files: list[Path] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)
    places_mm: list[float] = field(default_factory=list)
    traits: list[dict[str, str]] = field(default_factory=list)
    differs: str = ""

    def add(self, frame: Frame) -> None:
        """Add a slice."""
        self.files.append(frame.file)
        self.numbers.append(frame.number)
        normal = np.cross(self.axes[:3], self.axes[3:])
        try:
            place = float(frame.numbers("ImagePositionPatient", 3) @ normal)
        except UserError:
            # who reads the series is told
            place = np.nan
        self.places_mm.append(place)
        told = {name: frame.get(name) for name in TRAITS}
        uid = frame.image.get("SOPInstanceUID")
        self.traits.append({n: str(v) for n, v in told.items() if v} | {UID: str(uid)})

    def part(self, kept: list[int], differs: str = "") -> "DicomSeries":
        """Return a series of some of the slices."""
        return replace(
            self,
            files=[self.files[n] for n in kept],
            numbers=[self.numbers[n] for n in kept],
            places_mm=[self.places_mm[n] for n in kept],
            traits=[self.traits[n] for n in kept],
            differs=differs,
        )

    def lies_as(
        self, axes: NDArray[np.float64], spacing_mm: NDArray[np.float64]
    ) -> bool:
        """Return whether a slice lies as those of the series do, but for rounding."""
        return bool(
            np.abs(self.axes - axes).max() < SAME_WAY
            and np.abs(self.spacing_mm - spacing_mm).max() < SAME_SPACING_MM
        )

    def __str__(self) -> str:
        """Describe the series for a list to choose from."""
        name = f" {self.description!r}" if self.description else ""
        differs = f", {self.differs}" * bool(self.differs)
        return (
            f"{self.modality}{name}{differs}, {len(self.files)} slices of "
            f"{self.columns} x {self.rows}"
        )


NO_SCANS = *SEGMENTATIONS, "1.2.840.10008.5.1.4.1.1.481.2"
"""Kinds that lie beside a scan, in slices as it does: segmentations, and doses."""


@dataclass(frozen=True, slots=True)
class Examination:
    """What a folder holds. left_out: how many files of each kind are no slices."""

    series: list[DicomSeries]
    left_out: Counter[str]

    @property
    def kinds(self) -> str:
        """Return what is no slice, counted."""
        return "; ".join(f"{n} {kind}" for kind, n in sorted(self.left_out.items()))

    def notes(self, chosen: DicomSeries) -> list[str]:
        """Say what of the folder is not in the chosen series."""
        others = [str(one) for one in self.series if one is not chosen]
        return [
            *([f"files left out, being no slices: {self.kinds}"] * bool(self.left_out)),
            *([f"series left out: {'; '.join(others)}"] * bool(others)),
        ]


def find_series(folder: Path, progress: Progress | None = None) -> Examination:
    """List the series below a folder, those with most slices first.

    Images of one series that differ in size, orientation or pixel spacing, and the
    stacks and phases of an enhanced one, are listed apart. Files that are no slices are
    counted. Raises UserError when nothing is left, for a damaged DICOM file, for
    more than 20,000 files, and for links that lead out of the folder.
    """
    files = examination_files(folder)
    found: dict[tuple[object, ...], list[DicomSeries]] = {}
    left_out: Counter[str] = Counter()
    unplaced = None
    for n, file in enumerate(files):
        if progress is not None:
            progress("Reading headers", n / len(files))
        if not is_dicom(file):
            left_out[_foreign(file)] += 1
            continue
        with foreign_file(file, "a DICOM file"):
            image = read_dicom(file, pixels=False)
            if not image.preamble and kind_of(image) is None and "Rows" not in image:
                # by chance its first bytes are such
                left_out[_foreign(file)] += 1
                continue
            check_whole(image, file)
            if kind_of(image) in NO_SCANS:
                left_out[_kind(image)] += 1
                continue
            frames = frames_of(image, file)
            if not frames:
                left_out[_kind(image)] += 1
                unplaced = file if has_many_frames(image) else unplaced
            for frame in frames:
                _sort_in(frame, found)
    if not found and unplaced is not None:
        raise UserError(f"{unplaced} {MANY_FRAMES}")
    if not found:
        kinds = Examination([], left_out).kinds
        raise UserError(
            f"{folder} holds {len(files)} files, none of which is a DICOM image with "
            f"a place in the patient{': ' * bool(kinds)}{kinds}"
        )
    series = [
        part
        for alike in found.values()
        for one in alike
        for part in _parted(_without_copies(one, left_out))
    ]
    return Examination(sorted(series, key=lambda s: -len(s.files)), left_out)


def _foreign(file: Path) -> str:
    return f"{file.suffix.lower() or 'without an ending'}, no DICOM"


def _kind(image: "Dataset") -> str:
    """Name what a DICOM file is that holds no slice."""
    uid = kind_of(image)
    what = "no scan" if uid in NO_SCANS else "without a place in the patient"
    return f"{'DICOM' if uid is None else uid.name}, {what}"


def _sort_in(frame: Frame, found: dict[tuple[object, ...], list[DicomSeries]]) -> None:
    """Add a slice to the series it belongs to, or begin one."""
    header = frame.image
    axes = frame.numbers("ImageOrientationPatient", 6)
    spacing = frame.numbers("PixelSpacing", 2)
    uid = str(header.get("SeriesInstanceUID", ""))
    rows, columns = int(header.Rows), int(header.Columns)
    alike = found.setdefault((uid, rows, columns, *frame.stack), [])
    for series in alike:
        if series.lies_as(axes, spacing):
            break
    else:
        series = DicomSeries(
            uid,
            str(header.get("Modality", "")) or "unknown",
            str(header.get("SeriesDescription", "")).strip(),
            rows,
            columns,
            axes,
            spacing,
        )
        alike.append(series)
    series.add(frame)


def _without_copies(series: DicomSeries, left_out: Counter[str]) -> DicomSeries:
    """Leave out slices that are in the folder twice."""
    kept: dict[tuple[str, int], int] = {}
    for n, (traits, number) in enumerate(
        zip(series.traits, series.numbers, strict=True)
    ):
        kept.setdefault((traits[UID], number), n)
    copies = len(series.files) - len(kept)
    if copies:
        left_out["copies of slices"] += copies
    return series.part(list(kept.values())) if copies else series


def _parted(series: DicomSeries) -> list[DicomSeries]:
    """Part a series that has several pictures of a place by what tells them apart.

    Bone and soft kernel, phases and echoes may share one series. Where nothing does,
    it stays whole, and who reads it is told.
    """
    places = np.round(np.array(series.places_mm) / SAME_PLACE_MM)
    each = np.unique(places, return_counts=True)[1]
    if each.max(initial=0) < 2 or not np.isfinite(places).all():
        return [series]
    for name, called in TRAITS.items():
        groups: dict[str, list[int]] = {}
        for n, traits in enumerate(series.traits):
            groups.setdefault(traits.get(name, ""), []).append(n)
        is_told_apart = all(
            len(np.unique(places[group])) == len(group) for group in groups.values()
        )
        if is_told_apart and len(groups) == each.max():
            return [
                series.part(group, f"{called} {value or 'not told'}")
                for value, group in groups.items()
            ]
    return [series]


def choose_series(
    series: list[DicomSeries], which: int | None, file: Path | None = None
) -> DicomSeries:
    """Take one series of a list, counted from 1.

    None takes the one that a file is of, or the only one that is a volume. Raises
    UserError with the list when there is a choice.
    """
    named = [s for s in series if file in s.files]
    series = named if named and which is None else series
    listing = "; ".join(f"{i + 1}: {s}" for i, s in enumerate(series))
    if which is not None:
        if not 1 <= which <= len(series):
            raise UserError(f"there is no series {which}; there are {listing}")
        return series[which - 1]
    volumes = [s for s in series if len(s.files) >= FEWEST_SLICES]
    if len(volumes) == 1:
        return volumes[0]
    if not volumes:
        raise UserError(
            f"no series has the {FEWEST_SLICES} slices of a volume: {listing}"
        )
    raise UserError(f"the folder holds several series, choose one: {listing}")


def read_series(
    series: DicomSeries, *, allow_gaps: bool = False, progress: Progress | None = None
) -> tuple[Volume, StackLayout]:
    """Read a series as a volume in LPS and HU (MR: stored values), float32 or int16.

    Gives it with how its slices lay. allow_gaps: bridge missing slices by
    interpolation instead of refusing the series. Raises UserError naming the file
    that is damaged or does not fit.
    """
    need = series.rows * series.columns * len(series.files) * WORKING_BYTES
    limit = memory_limit()
    if need > limit:
        raise UserError(
            f"the series {series} needs {need:,} bytes; at most {limit:,} can be read "
            "on this machine"
        )
    pixels, positions, thickness = [], [], []
    wanted: dict[Path, list[int]] = {}
    for file, number in zip(series.files, series.numbers, strict=True):
        wanted.setdefault(file, []).append(number)
    for n, (file, numbers) in enumerate(wanted.items()):
        if progress is not None:
            progress("Reading slices", n / len(wanted))
        with foreign_file(file, "a DICOM file"):
            held = frames_of(read_dicom(file), file)
            frames = [held[number] for number in numbers]
            pixels += frame_values(frames)
            positions += [f.numbers("ImagePositionPatient", 3) for f in frames]
            thickness += [f.thickness_mm for f in frames]
    if len(pixels) < 2:
        raise UserError(f"the series {series} is no volume")
    stack = SliceStack(
        np.stack(pixels),
        np.stack(positions),
        series.axes[:3],
        series.axes[3:],
        # the standard names the distance between rows first
        (float(series.spacing_mm[1]), float(series.spacing_mm[0])),
        np.array(thickness),
    ).ordered()
    layout = StackLayout.of(stack)
    missing = layout.missing()
    if missing and not allow_gaps:
        raise UserError(
            f"the series {series} lacks {sum(m for _, m in missing)} slices: "
            f"{_places(stack, missing)}; copy them again, or allow gaps to bridge them"
        )
    volume = straighten(stack, AIR_HU if series.modality == "CT" else 0.0)
    low, high = volume.value_range
    whole = not (np.asarray(volume.values) % 1).any()
    if whole and low >= -32768 and high <= 32767:
        volume = volume.with_values(volume.values.astype(np.int16), volume.background)
    return volume, layout


def layout_notes(layout: StackLayout, volume: Volume) -> list[str]:
    """Say what was done to slices that lay so to make them a volume."""
    missing = layout.missing()
    notes = []
    if not layout.is_regular:
        low, high = layout.steps_mm.min(), layout.steps_mm.max()
        notes.append(
            f"slices {low:.2f} to {high:.2f} mm apart, gantry tilted by "
            f"{layout.tilt_deg:.1f} degrees: interpolated on even steps of "
            f"{volume.spacing_mm[2]:.2f} mm"
        )
    if missing:
        lost = sum(m for _, m in missing)
        notes.append(f"{lost} missing slices bridged by interpolation")
    thickness = layout.thickness_mm
    usual = float(np.median(layout.steps_mm))
    if thickness is not None and usual > SPARSE * np.median(thickness):
        notes.append(
            f"slices of {np.median(thickness):.2f} mm lie {usual:.2f} mm apart: what "
            "is between them was not scanned, or every other slice is lost"
        )
    return notes


def _places(stack: SliceStack, missing: list[tuple[int, int]]) -> str:
    """Say after which slices how many are lost."""
    depth = stack.positions_mm @ stack.normal
    listed = [f"{lost} after the one at {depth[i]:.1f} mm" for i, lost in missing]
    more = len(listed) - LISTED_GAPS
    return ", ".join(listed[:LISTED_GAPS]) + (f" and {more} gaps more" * (more > 0))
