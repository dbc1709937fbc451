"""Volumes in the files that other programs read and write."""

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from anatomy.files.data_files import check_data_files
from anatomy.files.nifti_header import header_file, read_nifti_header
from anatomy.files.volume_header import check_header
from disk import UserError, foreign_file, simple_itk, whole_file
from renderers.scene import AIR_HU, Volume

_HEADER_TOLERANCE = 1e-3
"""Largest departure from orthonormal axes that counts as rounding in a header."""


FORMATS = ("NrrdImageIO", "NiftiImageIO", "MetaImageIO")
"""The readers of SimpleITK that foreign files are given to."""


MOST_LAYERS = 64
"""Values that a voxel of a segmentation may have."""


def load_volume(path: Path | str, background: float = AIR_HU) -> Volume:
    """Read a volume that SimpleITK knows (NRRD, NIfTI, MetaImage), in LPS.

    The orientation of the file is kept in `Volume.direction`. Raise ValueError with
    one sentence naming the file if it is missing, no volume, not 3-D, in colour, too
    large for this machine, or does not tell left from right.
    """
    with foreign_file(path, "a volume"):
        return _load(str(path), background, 1)[0]


def load_layers(path: Path | str, background: float = AIR_HU) -> tuple[Volume, ...]:
    """Read a volume that may hold several values a voxel; see `load_volume`.

    So 3D Slicer stores segments that overlap. Return one volume for each.
    """
    with foreign_file(path, "a volume"):
        return _load(str(path), background, MOST_LAYERS)


def _load(name: str, background: float, most_layers: int) -> tuple[Volume, ...]:
    sitk = simple_itk()

    if not Path(name).is_file():
        raise UserError(f"there is no volume file {name}")
    check_data_files(Path(name))
    reader = sitk.ImageFileReader()
    reader.SetFileName(name)
    try:
        kind = reader.GetImageIOFromFileName(name)
        if kind not in FORMATS:
            raise RuntimeError(f"{kind or 'nothing'} is not among {FORMATS}")
        reader.SetImageIO(kind)
        if kind == "NiftiImageIO":
            # Its reader never comes back from an sform with NaN.
            read_nifti_header(header_file(name))
        reader.ReadImageInformation()
    except RuntimeError as error:
        raise UserError(
            f"{name} cannot be read as a volume; NRRD, NIfTI and MetaImage files can"
        ) from error
    pixel_type = sitk.GetPixelIDValueAsString(reader.GetPixelID())
    check_header(reader, name, pixel_type, most_layers)
    try:
        image = reader.Execute()
    except RuntimeError as error:
        raise UserError(
            f"{name} is damaged: its values cannot be read, or its axes are not at "
            "right angles"
        ) from error
    direction = np.array(image.GetDirection(), dtype=np.float64).reshape(3, 3)
    left, _, right = np.linalg.svd(direction)
    rigid = left @ right
    if np.abs(rigid - direction).max() > _HEADER_TOLERANCE:
        raise UserError(
            f"{name} has axes that are not at right angles: {direction.tolist()}"
        )
    values = sitk.GetArrayFromImage(image)
    layers = [values] if values.ndim == 3 else list(np.moveaxis(values, -1, 0))
    try:
        return tuple(
            Volume(
                np.ascontiguousarray(layer),
                np.array(image.GetSpacing()),
                np.array(image.GetOrigin()),
                rigid,
                background,
            )
            for layer in layers
        )
    except ValueError as error:
        raise UserError(f"{name} is no usable volume: {error}") from error


def save_volume(
    volume: Volume, path: Path | str, metadata: dict[str, str] | None = None
) -> None:
    """Write a volume, atomically, in the format that the file's name ends with.

    metadata: extra header fields, which NRRD keeps. Raise ValueError for a name that
    SimpleITK has no format for, or that needs a second file; OSError if the folder
    cannot be written to.
    """
    sitk = simple_itk()

    target = Path(path)
    image = sitk.GetImageFromArray(volume.values)
    image.SetSpacing([float(v) for v in volume.spacing_mm])
    image.SetOrigin([float(v) for v in volume.origin_mm])
    image.SetDirection([float(v) for v in volume.direction.ravel()])
    for key, value in (metadata or {}).items():
        image.SetMetaData(key, value)
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".part-") as folder:
        temporary = Path(folder) / target.name
        try:
            sitk.WriteImage(image, str(temporary), useCompression=True)
        except RuntimeError as error:
            raise UserError(
                f"{target} cannot be written as a volume: {_last_line(error)}"
            ) from error
        if len(os.listdir(folder)) > 1:
            raise UserError(
                f"{target} would be two files, header and values; save it as .nrrd, "
                ".nii.gz or .mha"
            )
        os.replace(temporary, target)


def write_file(path: Path, content: bytes) -> None:
    """Write a small file as a whole or not at all, readable by all as usual."""
    with whole_file(path) as beside:
        beside.write_bytes(content)


def _last_line(error: Any) -> str:
    return str(error).strip().splitlines()[-1]
