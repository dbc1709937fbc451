"""What a volume file says of itself, judged before its values are read.

A header can claim anything: petabytes, no spacing, no frame. What cannot become a
volume that is in its right place is refused here, before memory is asked for.
"""

import gzip
import zlib
from pathlib import Path
from typing import Any

from anatomy.files.nifti_header import NIFTI_ENDINGS, read_nifti_header
from disk import UserError
from renderers.scene.memory_limit import memory_limit
from renderers.scene.volume import WIDEST_RATIO

MOST_HEADER_BYTES = 65_536

SPACES = ("left-posterior-superior", "left-posterior-superior-time")
"""The reader turns RAS and LAS into the first one; other names place nobody."""

EXPANDED_BYTES, MOST_PACKED = 1 << 30, 200
"""What is larger than that and was packed to less than one in 200 is no scan: air
alone, with its noise, packs to one in five."""

CHUNK_BYTES = 1 << 20

_BYTES = {
    "8-bit signed integer": 1,
    "8-bit unsigned integer": 1,
    "16-bit signed integer": 2,
    "16-bit unsigned integer": 2,
    "32-bit signed integer": 4,
    "32-bit unsigned integer": 4,
    "64-bit signed integer": 8,
    "64-bit unsigned integer": 8,
    "32-bit float": 4,
    "64-bit float": 8,
}


def check_header(reader: Any, name: str, pixel_type: str, most_layers: int = 1) -> None:
    """Refuse a file whose header has been read but not its values.

    reader: SimpleITK's ``ImageFileReader`` after ``ReadImageInformation``. most_layers:
    values that a voxel may have. Raises
    ValueError, in one sentence that names the file and what is wrong with it.
    """
    dimension, parts = reader.GetDimension(), reader.GetNumberOfComponents()
    pixel_type = pixel_type.removeprefix("vector of ")
    if dimension != 3 or parts > most_layers:
        raise UserError(
            f"{name} must hold one 3-D volume of numbers, but has {dimension} "
            f"dimensions and {parts} values per voxel"
        )
    if pixel_type not in _BYTES:
        raise UserError(f"{name} must hold real numbers, not {pixel_type}")
    size = reader.GetSize()
    if min(size) < 2:
        raise UserError(
            f"{name} is {size[0]} x {size[1]} x {size[2]} voxels; a volume has at "
            "least 2 along each axis"
        )
    need = size[0] * size[1] * size[2] * parts * _BYTES[pixel_type]
    limit = memory_limit()
    if need > limit:
        raise UserError(
            f"{name} says it is {size[0]} x {size[1]} x {size[2]} voxels, which needs "
            f"{need:,} bytes; at most {limit:,} can be read on this machine"
        )
    packed = Path(name).stat().st_size
    if need > EXPANDED_BYTES and need > MOST_PACKED * packed and _is_alone(name):
        raise UserError(
            f"{name} says that its {packed:,} bytes unpack to {need:,}; no scan can be "
            "packed so far"
        )
    spacing = reader.GetSpacing()
    if any(s < 0 for s in spacing):
        raise UserError(
            f"{name} has a negative spacing {spacing}; a flipped axis belongs into "
            "the direction matrix"
        )
    # NaN is neither
    if not all(0 < s < float("inf") for s in spacing):
        raise UserError(f"{name} has an unusable spacing of {spacing} mm")
    if max(spacing) > WIDEST_RATIO * min(spacing):
        raise UserError(
            f"{name} has a spacing of {spacing} mm, whose ratio is beyond "
            f"{WIDEST_RATIO:g}; one of the numbers is in another unit"
        )
    _check_frame(reader, name, parts > 1)
    if name.lower().endswith(NIFTI_ENDINGS):
        # the reader announces rescaled values, which the file does not hold
        _check_length(name, read_nifti_header(name).stored_bytes)


def _is_alone(name: str) -> bool:
    """Return whether the values lie in the header's own file."""
    return not name.lower().endswith((".nhdr", ".mhd", ".hdr", ".img"))


def _check_frame(reader: Any, name: str, has_layers: bool) -> None:
    """Refuse what does not tell left from right; layers are an axis of their own."""
    keys = set(reader.GetMetaDataKeys())
    if "qform_code" in keys:
        told = [reader.GetMetaData(k) for k in ("qform_code", "sform_code")]
        if told == ["0", "0"]:
            raise UserError(
                f"{name} does not say how it lies in the patient (qform and sform are "
                "0), so left and right are unknown; convert the DICOM images again"
            )
        return
    if name.lower().endswith((".nrrd", ".nhdr")):
        space = reader.GetMetaData("NRRD_space") if "NRRD_space" in keys else "none"
        if space not in SPACES:
            raise UserError(
                f"{name} does not say how it lies in the patient (its space is "
                f"{space!r}), so left and right are unknown; save it with the space "
                "left-posterior-superior"
            )
        if not has_layers and _has_loose_axis(name):
            raise UserError(
                f"{name} has an axis that is none of the patient's; save the one 3-D "
                "volume that is wanted"
            )


def _check_length(name: str, need: int) -> None:
    """Refuse a cut NIfTI, whose reader would make up the rest as zeros."""
    have = 0
    try:
        with gzip.open(name) if name.lower().endswith(".gz") else open(name, "rb") as f:
            # no more than is claimed is ever unpacked
            while have < need:
                got = len(f.read(min(CHUNK_BYTES, need - have)))
                if not got:
                    break
                have += got
    except (EOFError, OSError, zlib.error) as error:
        raise UserError(f"{name} is cut off or damaged: {error}") from error
    if have < need:
        raise UserError(f"{name} is cut off: {have:,} of {need:,} bytes are there")


def _has_loose_axis(name: str) -> bool:
    """Return whether an NRRD gives an axis no direction, which the reader invents."""
    with open(name, "rb") as file:
        header = file.read(MOST_HEADER_BYTES).partition(b"\n\n")[0]
    for line in header.lower().splitlines():
        field, _, value = line.partition(b":")
        if field.strip() == b"space directions":
            return b"none" in value or b"nan" in value
    return False
