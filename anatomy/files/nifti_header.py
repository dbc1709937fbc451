"""What a NIfTI header says that its reader does not pass on.

The reader rescales values, so that they are no longer what the file stores, and takes
one of two frames without a word about the other.
"""

import gzip
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from disk import UserError, foreign_file
from renderers.scene.volume import Volume

NIFTI_ENDINGS = (".nii", ".nii.gz")

AGREEING_MM = 0.3
"""Two frames that put no corner further apart are one, but for rounding."""

SAME_SIDE = float(np.cos(np.radians(45.0)))
"""Cosine between two axes below which they do not name the same side."""

_LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0])

MOST_DIMENSIONS = 7
"""That the format knows."""

HEADER_BYTES = 348
"""Of the first version of the format, the only one that the reader knows."""

_FIELDS = {
    "dim": ("8i2", 40),
    "bitpix": ("i2", 72),
    "pixdim": ("8f4", 76),
    "vox_offset": ("f4", 108),
    "qform_code": ("i2", 252),
    "sform_code": ("i2", 254),
    "quatern": ("3f4", 256),
    "qoffset": ("3f4", 268),
    "srow": ("(3,4)f4", 280),
}
"""Type and offset of each field."""


@dataclass(frozen=True, slots=True)
class NiftiHeader:
    """Hold what places a volume and how long its file is.

    stored_bytes: of header and values, before they are rescaled. qform, sform: LPS mm
    of voxel indices x y z, ``(3, 4)``; None where the file does not give one.
    """

    stored_bytes: int
    qform: NDArray[np.float64] | None
    sform: NDArray[np.float64] | None


def read_nifti_header(path: Path | str) -> NiftiHeader:
    """Read a header.

    Raise ValueError for a file that has none, or one whose frames are not finite.
    """
    name = str(path)
    packed = name.lower().endswith(".gz")
    with (
        foreign_file(name, "a NIfTI volume"),
        gzip.open(name) if packed else open(name, "rb") as file,
    ):
        head = file.read(HEADER_BYTES)
    orders: tuple[Literal["little", "big"], ...] = ("little", "big")
    for order in orders:
        if len(head) == HEADER_BYTES == int.from_bytes(head[:4], order):
            return _header(name, _record(head, order))
    raise UserError(f"{name} is no NIfTI file: its header has no known length")


def header_file(path: Path | str) -> str:
    """Return where the header is: beside an ``.img``, else in the file itself."""
    return re.sub(r"\.img(?=(\.gz)?$)", ".hdr", str(path), flags=re.IGNORECASE)


def _record(head: bytes, order: Literal["little", "big"]) -> Any:
    fields: Any = {
        "names": list(_FIELDS),
        "formats": [np.dtype(kind).newbyteorder(order) for kind, _ in _FIELDS.values()],
        "offsets": [offset for _, offset in _FIELDS.values()],
        "itemsize": HEADER_BYTES,
    }
    return np.frombuffer(head, np.dtype(fields), 1)[0]


def _header(name: str, record: Any) -> NiftiHeader:
    dimensions = int(record["dim"][0])
    # By this number the reader tells the order of the bytes.
    if not 1 <= dimensions <= MOST_DIMENSIONS:
        raise UserError(f"{name} is no NIfTI file: it says {dimensions} dimensions")
    extent = [int(n) for n in record["dim"][1 : 1 + dimensions]]
    voxels = 1
    for n in extent:
        voxels *= max(n, 1)
    start = _first_byte(float(record["vox_offset"]))
    qform = sform = None
    if record["qform_code"] > 0:
        placing = record["pixdim"][:4], record["quatern"], record["qoffset"]
        _check_finite(name, "qform", *placing)
        qform = _qform(record)
    if record["sform_code"] > 0:
        _check_finite(name, "sform", record["srow"])
        sform = _LPS_FROM_RAS @ np.array(record["srow"], np.float64)
    return NiftiHeader(start + voxels * int(record["bitpix"]) // 8, qform, sform)


def _check_finite(name: str, frame: str, *numbers: NDArray[np.float32]) -> None:
    if not all(np.isfinite(one).all() for one in numbers):
        raise UserError(
            f"{name} has a {frame} with numbers that are not finite, so its place is "
            "unknown; convert the DICOM images again"
        )


def _first_byte(told: float) -> int:
    """Return where the values begin; nonsense counts as right after the header."""
    return int(told) if HEADER_BYTES <= told < 2**53 else HEADER_BYTES


def _qform(record: Any) -> NDArray[np.float64]:
    """Turn the quaternion, of which the header holds three parts, into a frame."""
    b, c, d = (float(v) for v in record["quatern"])
    a = np.sqrt(max(1.0 - b * b - c * c - d * d, 0.0))
    turn = np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c],
        ]
    )
    spacing = np.array(record["pixdim"][1:4], np.float64)
    # the sign of the first number mirrors the slices
    spacing[2] *= -1.0 if record["pixdim"][0] < 0 else 1.0
    frame = np.column_stack([turn * spacing, record["qoffset"]])
    result: NDArray[np.float64] = _LPS_FROM_RAS @ frame
    return result


def frame_notes(path: Path, volume: Volume) -> list[str]:
    """Tell where a NIfTI file's two frames disagree, and which one was taken.

    volume: as read from the file. Other files give no notes. Raises ValueError
    where the frames name different sides of the patient, so that left may be right.
    """
    if not path.name.lower().endswith(NIFTI_ENDINGS):
        return []
    header = read_nifti_header(path)
    if header.qform is None or header.sform is None:
        return []
    apart = _apart_mm(header.qform, header.sform, volume)
    if not apart > AGREEING_MM:
        return []
    ways = [frame[:, :3] for frame in (header.qform, header.sform)]
    ways = [way / np.linalg.norm(way, axis=0) for way in ways]
    if (np.sum(ways[0] * ways[1], axis=0) < SAME_SIDE).any():
        raise UserError(
            f"{path} has a qform and an sform that name different sides of the "
            "patient, so left and right are unknown; convert the DICOM images again"
        )
    taken = volume.world_from_voxel[:3]
    nearer = min(
        ("qform", "sform"),
        key=lambda name: _apart_mm(getattr(header, name), taken, volume),
    )
    return [
        f"qform and sform of {path.name} disagree by up to {apart:.1f} mm: the "
        f"{nearer} is taken"
    ]


def _apart_mm(
    one: NDArray[np.float64], other: NDArray[np.float64], volume: Volume
) -> float:
    """Return how far two frames put a corner of the volume apart."""
    nz, ny, nx = volume.shape
    ends = np.array(np.meshgrid([0, nx - 1], [0, ny - 1], [0, nz - 1])).reshape(3, 8)
    corners = (one - other) @ np.vstack([ends, np.ones(8)])
    return float(np.linalg.norm(corners, axis=0).max())
