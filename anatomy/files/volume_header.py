"""What a volume file says of itself, judged before its values are read.

A header can claim anything: petabytes, no spacing, no frame. What cannot become a
volume that is in its right place is refused here, before memory is asked for.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from anatomy.files.text_header import TextHeader
from renderers.scene.memory_limit import memory_limit
from renderers.scene.volume import WIDEST_RATIO
from system import UserError

SPACES = ("left-posterior-superior", "left-posterior-superior-time")
"""The reader turns RAS and LAS into the first one; other names place nobody."""

EXPANDED_BYTES, MOST_PACKED = 1 << 30, 200
"""What is larger than that and was packed to less than one in 200 is no scan: air
alone, with its noise, packs to one in five."""

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


@dataclass(frozen=True, slots=True)
class Claims:
    """What a header says that its file holds.

    size: voxels along x, y, z and what else there is. parts: values a voxel.
    number_bytes: of each, 0 where it is no real number. kind: its type in words.
    """

    name: str
    size: tuple[int, ...]
    parts: int
    number_bytes: int
    kind: str


def check_header(
    reader: Any, header: TextHeader, kind: str, most_layers: int = 1
) -> None:
    """Refuse a file whose header has been read but not its values.

    reader: SimpleITK's ``ImageFileReader`` after ``ReadImageInformation``. most_layers:
    values that a voxel may have. Raises
    UserError, in one sentence that names the file and what is wrong with it.
    """
    parts, name = reader.GetNumberOfComponents(), str(header.path)
    kind = kind.removeprefix("vector of ")
    claims = Claims(name, reader.GetSize(), parts, _BYTES.get(kind, 0), kind)
    check_claims(claims, reader.GetSpacing(), most_layers)
    _check_frame(reader, header, parts > 1)


def check_claims(claims: Claims, spacing: tuple[float, ...], most_layers: int) -> None:
    """Refuse a header that claims what cannot be. Raises UserError as above."""
    name, size, parts = claims.name, claims.size, claims.parts
    if len(size) != 3 or parts > most_layers:
        raise UserError(
            f"{name} must hold one 3-D volume of numbers, but has {len(size)} "
            f"dimensions and {parts} values per voxel"
        )
    if not claims.number_bytes:
        raise UserError(f"{name} must hold real numbers, not {claims.kind}")
    if min(size) < 2:
        raise UserError(
            f"{name} is {size[0]} x {size[1]} x {size[2]} voxels; a volume has at "
            "least 2 along each axis"
        )
    need = size[0] * size[1] * size[2] * parts * claims.number_bytes
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


def is_paired(name: str) -> bool:
    """Return whether a NIfTI file is one of two, header and values."""
    return name.lower().removesuffix(".gz").endswith((".hdr", ".img"))


def _is_alone(name: str) -> bool:
    """Return whether the values lie in the header's own file."""
    return not (is_paired(name) or name.lower().endswith((".nhdr", ".mhd")))


def _check_frame(reader: Any, header: TextHeader, has_layers: bool) -> None:
    """Refuse what does not tell left from right; layers are an axis of their own."""
    keys, name = set(reader.GetMetaDataKeys()), str(header.path)
    if name.lower().endswith((".nrrd", ".nhdr")):
        space = reader.GetMetaData("NRRD_space") if "NRRD_space" in keys else "none"
        if space not in SPACES:
            raise UserError(
                f"{name} does not say how it lies in the patient (its space is "
                f"{space!r}), so left and right are unknown; save it with the space "
                "left-posterior-superior"
            )
        # the reader invents a direction for an axis that has none
        axes = header.fields.get("space directions", "").lower()
        if not has_layers and ("none" in axes or "nan" in axes):
            raise UserError(
                f"{name} has an axis that is none of the patient's; save the one 3-D "
                "volume that is wanted"
            )
