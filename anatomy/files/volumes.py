"""Volumes in the files that other programs read and write."""

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from anatomy.files.nifti import is_nifti, read_nifti
from anatomy.files.text_header import (
    TextHeader,
    check_beside,
    check_data_files,
    readable_copy,
    units_mm,
)
from anatomy.files.volume_frame import check_square, squared
from anatomy.files.volume_header import check_header
from renderers.scene import AIR_HU, Volume
from system import UserError, foreign_file, simple_itk, whole_file
from system.plain_text import checked_name

NRRD_MAGIC, META_ENDINGS = b"NRRD", (".mha", ".mhd")

LONGEST = 200
"""Characters of a library's complaint that a sentence repeats."""

MOST_LAYERS = 64
"""Values that a voxel of a segmentation may have."""


def load_volume(path: Path | str, background: float = AIR_HU) -> Volume:
    """Read a volume (NRRD, NIfTI, MetaImage), in LPS; see `read_volume`."""
    return read_volume(path, background)[0]


def read_volume(
    path: Path | str, background: float = AIR_HU
) -> tuple[Volume, list[str]]:
    """Read a volume (NRRD, NIfTI, MetaImage), in LPS, and tell what was done to it.

    The orientation of the file is kept in `Volume.direction`. Raise UserError with
    one sentence naming the file if it is missing, no volume, not 3-D, in colour, too
    large for this machine, or does not tell left from right.
    """
    with foreign_file(path, "a volume"):
        (volume,), notes = _load(Path(path), background, 1)
    return volume, notes


def load_layers(path: Path | str, background: float = AIR_HU) -> tuple[Volume, ...]:
    """Read labels that may have several values a voxel; see `read_volume`.

    So 3D Slicer stores segments that overlap. Return one volume for each.
    """
    with foreign_file(path, "a volume"):
        return _load(Path(path), background, MOST_LAYERS)[0]


def _load(
    path: Path, background: float, most_layers: int
) -> tuple[tuple[Volume, ...], list[str]]:
    checked_name(path)
    if not path.is_file():
        raise UserError(f"there is no volume file {path}")
    if is_nifti(path):
        if path.suffix.lower() in (".hdr", ".img"):
            for partner in (".hdr", ".img"):
                check_beside(path, path.with_suffix(partner).name)
        found = read_nifti(path, most_layers)
        layers, frame, notes = found.layers, found.frame, found.notes
    else:
        header = TextHeader.read(path)
        check_data_files(header)
        factors, notes = units_mm(header)
        with readable_copy(header) as readable:
            layers, frame = _read_with_itk(header, readable, most_layers)
        frame = factors[:, None] * frame
    # labels are not mixed
    grid = squared(path.name, layers, frame, 1 if most_layers == 1 else 0)
    try:
        return tuple(
            Volume(layer, grid.spacing_mm, grid.origin_mm, grid.direction, background)
            for layer in grid.layers
        ), [*notes, *grid.notes]
    except ValueError as error:
        raise UserError(f"{path} is no usable volume: {error}") from error


def _read_with_itk(
    header: TextHeader, readable: Path, most_layers: int
) -> tuple[list[NDArray[Any]], NDArray[np.float64]]:
    """Return the layers ``(nz, ny, nx)`` of a file, and its frame ``(3, 4)``.

    readable: what is read in its place.
    """
    sitk = simple_itk()
    path, name = header.path, str(header.path)
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(readable))
    try:
        reader.SetImageIO(_format(path, readable))
        reader.ReadImageInformation()
    except RuntimeError as error:
        raise UserError(
            f"{name} cannot be read as a volume: {_reason(error)}"
        ) from error
    pixel_type = sitk.GetPixelIDValueAsString(reader.GetPixelID())
    check_header(reader, header, pixel_type, most_layers)
    axes = np.array(reader.GetDirection(), np.float64).reshape(3, 3)
    frame = np.column_stack([axes * reader.GetSpacing(), reader.GetOrigin()])
    check_square(name, frame)
    try:
        image = reader.Execute()
    except RuntimeError as error:
        raise UserError(
            f"{name} is damaged, its values cannot be read: {_reason(error)}"
        ) from error
    values = sitk.GetArrayFromImage(image)
    layers = [values] if values.ndim == 3 else list(np.moveaxis(values, -1, 0))
    return [np.ascontiguousarray(layer) for layer in layers], frame


def _format(path: Path, readable: Path) -> str:
    """Return the reader of SimpleITK for a file.

    SimpleITK itself would ask all its readers, of which that for DICOM takes 2 GB for
    some files of 164 bytes.
    """
    with readable.open("rb") as file:
        if file.read(len(NRRD_MAGIC)) == NRRD_MAGIC:
            return "NrrdImageIO"
    if readable.name.lower().endswith(META_ENDINGS):
        return "MetaImageIO"
    raise UserError(
        f"{path} cannot be read as a volume; NRRD, NIfTI and MetaImage files can"
    )


def save_volume(
    volume: Volume, path: Path | str, metadata: dict[str, str] | None = None
) -> None:
    """Write a volume, atomically, in the format that the file's name ends with.

    metadata: extra header fields, which NRRD keeps. Raise UserError for a name that
    SimpleITK has no format for, or that needs a second file; OSError if the folder
    cannot be written to.
    """
    target = Path(checked_name(path))
    image = as_image(volume)
    for key, value in (metadata or {}).items():
        image.SetMetaData(key, value)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".part-") as folder:
        temporary = Path(folder) / target.name
        try:
            simple_itk().WriteImage(image, str(temporary), useCompression=True)
        except RuntimeError as error:
            raise UserError(
                f"{target} cannot be written as a volume: {_reason(error)}"
            ) from error
        if len(os.listdir(folder)) > 1:
            raise UserError(
                f"{target} would be two files, header and values; save it as .nrrd, "
                ".nii.gz or .mha"
            )
        os.replace(temporary, target)


def as_image(volume: Volume) -> Any:
    """Return a volume as an image of SimpleITK, which carries no types."""
    image = simple_itk().GetImageFromArray(volume.values)
    image.SetSpacing(volume.spacing_mm.tolist())
    image.SetOrigin(volume.origin_mm.tolist())
    image.SetDirection(volume.direction.ravel().tolist())
    return image


def write_file(path: Path, content: bytes) -> None:
    """Write a small file as a whole or not at all."""
    with whole_file(path) as beside:
        beside.write_bytes(content)


def _reason(error: Exception) -> str:
    """Return the last sentence of what ITK says, which is the cause."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    found = next((line for line in reversed(lines) if " " in line), "it does not say")
    return found.rpartition("): ")[2].removeprefix("ITK ERROR: ")[:LONGEST].rstrip(".")
