"""DICOM folders: which series there are, and one of them as a volume.

Headers and uncompressed pixels are read by pydicom; what is compressed is decoded by
SimpleITK. Nothing is guessed: a series that lacks a position, a size or a piece of a
file is refused with the file's name.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from anatomy.slices import Layout, SliceStack, straighten
from renderers.scene.memory import memory_limit
from renderers.scene.volume import AIR_HU, Volume

MOST_FILES = 20_000
"""A head at 0.3 mm has about a thousand slices."""

WORKING_BYTES = 12
"""For each pixel: it is held as a float, put into order, and resampled."""

FEWEST_SLICES = 5
"""A series of fewer is a scout image, not a volume."""

Progress = Callable[[str, float], None]


@dataclass(slots=True)
class DicomSeries:
    """Hold the files of one series that share one geometry."""

    uid: str
    modality: str
    description: str
    rows: int
    columns: int
    files: list[Path] = field(default_factory=list)

    def __str__(self) -> str:
        """Describe the series for a list to choose from."""
        name = f" {self.description!r}" if self.description else ""
        return (
            f"{self.modality}{name}, {len(self.files)} slices of "
            f"{self.columns} x {self.rows}"
        )


def find_series(folder: Path, progress: Progress | None = None) -> list[DicomSeries]:
    """List the series below a folder, those with most slices first.

    Images of one series that differ in size, orientation or pixel spacing are listed
    apart. Files that are not DICOM are passed over. Raises ValueError when nothing
    is left, or for more than 20,000 files.
    """
    pydicom = importlib.import_module("pydicom")
    files = []
    for file in sorted(folder.rglob("*")):
        if file.is_file():
            files.append(file)
        if len(files) > MOST_FILES:
            raise ValueError(
                f"{folder} holds more than {MOST_FILES:,} files; name the folder of "
                "one examination"
            )
    found: dict[tuple[object, ...], DicomSeries] = {}
    for n, file in enumerate(files):
        if progress is not None:
            progress("Reading headers", n / len(files))
        try:
            header = pydicom.dcmread(file, stop_before_pixels=True)
        except (pydicom.errors.InvalidDicomError, OSError, EOFError, ValueError):
            continue
        if "Rows" not in header or "ImageOrientationPatient" not in header:
            continue
        axes = np.round(_numbers(header, "ImageOrientationPatient", 6, file), 3)
        spacing = np.round(_numbers(header, "PixelSpacing", 2, file), 4)
        uid = str(header.get("SeriesInstanceUID", ""))
        rows, columns = int(header.Rows), int(header.Columns)
        key = (uid, rows, columns, *axes.tolist(), *spacing.tolist())
        if key not in found:
            found[key] = DicomSeries(
                uid,
                str(header.get("Modality", "")) or "unknown",
                str(header.get("SeriesDescription", "")).strip(),
                rows,
                columns,
            )
        found[key].files.append(file)
    if not found:
        raise ValueError(
            f"{folder} holds {len(files)} files, none of which is a DICOM image with "
            "a place in the patient"
        )
    return sorted(found.values(), key=lambda s: -len(s.files))


def choose_series(series: list[DicomSeries], which: int | None) -> DicomSeries:
    """Take one series of a list, counted from 1.

    None takes the only one that is a volume. Raises ValueError with the list when
    there is a choice.
    """
    listing = "; ".join(f"{i + 1}: {s}" for i, s in enumerate(series))
    if which is not None:
        if not 1 <= which <= len(series):
            raise ValueError(f"there is no series {which}; there are {listing}")
        return series[which - 1]
    volumes = [s for s in series if len(s.files) >= FEWEST_SLICES]
    if len(volumes) == 1:
        return volumes[0]
    if not volumes:
        raise ValueError(
            f"no series has the {FEWEST_SLICES} slices of a volume: {listing}"
        )
    raise ValueError(f"the folder holds several series, choose one: {listing}")


def read_series(
    series: DicomSeries, *, allow_gaps: bool = False, progress: Progress | None = None
) -> tuple[Volume, list[str]]:
    """Read a series as a volume in LPS and HU (MR: stored values), float32 or int16.

    Gives it with notes on what was done to it. allow_gaps: bridge missing slices by
    interpolation instead of refusing the series. Raises ValueError naming the file
    that is damaged or does not fit.
    """
    pydicom = importlib.import_module("pydicom")
    need = series.rows * series.columns * len(series.files) * WORKING_BYTES
    limit = memory_limit()
    if need > limit:
        raise ValueError(
            f"the series {series} needs {need:,} bytes; at most {limit:,} can be read "
            "on this machine"
        )
    pixels, positions = [], []
    axes = spacing = None
    for n, file in enumerate(series.files):
        if progress is not None:
            progress("Reading slices", n / len(series.files))
        try:
            image = pydicom.dcmread(file)
        except (OSError, EOFError, ValueError) as error:
            raise ValueError(f"{file} cannot be read: {error}") from error
        pixels.append(_pixels(image, file))
        positions.append(_numbers(image, "ImagePositionPatient", 3, file))
        axes = _numbers(image, "ImageOrientationPatient", 6, file)
        spacing = _numbers(image, "PixelSpacing", 2, file)
    if axes is None or spacing is None or len(pixels) < 2:
        raise ValueError(f"the series {series} is no volume")
    stack = SliceStack(
        np.stack(pixels),
        np.stack(positions),
        axes[:3],
        axes[3:],
        # the standard names the distance between rows first
        (float(spacing[1]), float(spacing[0])),
    ).ordered()
    layout = Layout.of(stack)
    missing = layout.missing()
    if missing and not allow_gaps:
        before, lost = missing[0]
        place = stack.positions_mm[before] @ stack.normal
        raise ValueError(
            f"the series {series} lacks {sum(m for _, m in missing)} slices, the "
            f"first {lost} after the one at {place:.1f} mm; copy them again, or allow "
            "gaps to bridge them"
        )
    volume = straighten(stack, AIR_HU if series.modality == "CT" else 0.0)
    low, high = volume.value_range
    whole = not (np.asarray(volume.values) % 1).any()
    if whole and low >= -32768 and high <= 32767:
        volume = volume.with_values(volume.values.astype(np.int16), volume.background)
    return volume, _notes(layout, missing, volume)


def _notes(layout: Layout, missing: list[tuple[int, int]], volume: Volume) -> list[str]:
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
    return notes


def _pixels(image: Any, file: Path) -> NDArray[np.float32]:
    """Give one slice in real units."""
    if int(image.get("SamplesPerPixel", 1)) != 1:
        raise ValueError(f"{file} is a colour image, not a slice of numbers")
    if int(image.get("NumberOfFrames", 1)) != 1:
        raise ValueError(
            f"{file} holds many frames in one file (enhanced DICOM); export it as one "
            "file a slice"
        )
    if image.get("PhotometricInterpretation", "MONOCHROME2") != "MONOCHROME2":
        raise ValueError(
            f"{file} is stored as {image.PhotometricInterpretation}; slices of numbers "
            "are MONOCHROME2"
        )
    if image.file_meta.TransferSyntaxUID.is_compressed:
        raw = _decoded(file)
    else:
        bits = int(image.BitsAllocated)
        need = int(image.Rows) * int(image.Columns) * bits // 8
        have = len(image.get("PixelData", b""))
        if have < need:
            raise ValueError(
                f"{file} is cut off: {have:,} of {need:,} bytes of pixels are there"
            )
        try:
            raw = image.pixel_array
        except (ValueError, AttributeError, NotImplementedError, RuntimeError) as error:
            raise ValueError(f"{file} has unreadable pixels: {error}") from error
    slope = float(image.get("RescaleSlope", 1))
    intercept = float(image.get("RescaleIntercept", 0))
    # in floats: a stored -32768 less 1024 does not fit its own type
    values = raw.astype(np.float32) * np.float32(slope) + np.float32(intercept)
    padding = image.get("PixelPaddingValue")
    if padding is not None and image.get("Modality") == "CT":
        values[raw == padding] = AIR_HU
    result: NDArray[np.float32] = values
    return result


def _decoded(file: Path) -> NDArray[Any]:
    """Decode a compressed slice; gives stored values, not rescaled ones."""
    sitk = importlib.import_module("SimpleITK")
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(file))
    reader.SetImageIO("GDCMImageIO")
    try:
        decoded = sitk.GetArrayFromImage(reader.Execute())
    except RuntimeError as error:
        raise ValueError(f"{file} holds pixels that cannot be decoded") from error
    header = importlib.import_module("pydicom").dcmread(file, stop_before_pixels=True)
    slope = float(header.get("RescaleSlope", 1))
    intercept = float(header.get("RescaleIntercept", 0))
    stored: NDArray[np.float64] = np.rint((decoded[0] - intercept) / slope)
    return stored


def _numbers(header: Any, name: str, count: int, file: Path) -> NDArray[np.float64]:
    """Read a list of numbers; ValueError names the file that lacks it."""
    value = header.get(name)
    try:
        numbers = np.array([float(v) for v in value], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{file} has no {name}, which places it") from error
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise ValueError(f"{file} has an unusable {name}: {value}")
    return numbers
