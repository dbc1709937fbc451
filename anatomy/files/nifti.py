"""NIfTI files: nibabel knows their headers, of both versions of the format.

ITK's reader knows the first version alone, takes one of two frames without a word about
the other, and puts an sform's directions together with another field's spacing.
"""

import gzip
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from anatomy.files.volume_header import Claims, check_claims, is_paired
from system import UserError, foreign_file

if TYPE_CHECKING:
    from nibabel import Nifti1Header

NIFTI_ENDINGS = (".nii", ".nii.gz", ".hdr", ".hdr.gz", ".img", ".img.gz")

AGREEING_MM = 0.3
"""Two frames that put no corner further apart are one, but for rounding."""

SAME_SIDE = float(np.cos(np.radians(45.0)))
"""Cosine between two axes below which they do not name the same side."""

GZIP = b"\x1f\x8b"

HEADER_BYTES = {348: 1, 540: 2}
"""Of each version of the format."""

MOST_DIMENSIONS = 7
"""That the format knows."""

UNITS_MM = {"meter": 1e3, "mm": 1.0, "micron": 1e-3, "unknown": 1.0}

_LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0])


@dataclass(frozen=True, slots=True)
class NiftiFile:
    """A file's values and where they lie.

    layers: each ``(nz, ny, nx)``, rescaled. frame: ``(3, 4)`` LPS mm of voxel indices
    x y z. notes: what its header contradicts itself about.
    """

    layers: list[NDArray[Any]]
    frame: NDArray[np.float64]
    notes: list[str]


def is_nifti(path: Path) -> bool:
    """Return whether a file is NIfTI by its name."""
    return path.name.lower().endswith(NIFTI_ENDINGS)


def opened(path: Path) -> BinaryIO | gzip.GzipFile:
    """Open a file, unpacking it where its first bytes say that it is packed."""
    with path.open("rb") as file:
        is_packed = file.read(len(GZIP)) == GZIP
    return gzip.open(path) if is_packed else path.open("rb")


def read_nifti(path: Path, most_layers: int) -> NiftiFile:
    """Read a file, or a pair of header and values.

    Of two frames the sform counts, as the standard says. Raises UserError naming a
    file that is cut off, or whose place is unknown.
    """
    header_path = _partner(path, ".hdr")
    with foreign_file(header_path, "a NIfTI volume"):
        header = _header(header_path)
        size = [int(n) for n in header.get_data_shape()]
        while len(size) > 3 and size[-1] == 1:
            size.pop()
    parts = size.pop() if len(size) == 5 and size[3] == 1 else 1
    size = size[:3] if parts > 1 else size
    dtype = header.get_data_dtype()
    is_number = dtype.kind in "iuf" and dtype.itemsize <= 8
    name, values_path = str(path), _partner(path, ".img")
    frame, notes = _placed(header_path, header, size)
    spacing = np.linalg.norm(frame[:, :3], axis=0)
    claims = Claims(name, tuple(size), parts, dtype.itemsize * is_number, str(dtype))
    check_claims(claims, tuple(spacing.tolist()), most_layers)
    need = int(np.prod(size)) * parts * dtype.itemsize
    start = int(header["vox_offset"]) if values_path == header_path else 0
    raw: Any = np.frombuffer(_read(values_path, start, need), dtype)
    slope, intercept = header.get_slope_inter()
    if slope is not None and (slope, intercept) != (1.0, 0.0):
        wide = np.float64 if dtype.itemsize > 2 else np.float32
        raw = raw.astype(wide) * wide(slope) + wide(intercept or 0.0)
    layers = raw.reshape(parts, *size[::-1]).astype(raw.dtype.newbyteorder("="))
    return NiftiFile(list(layers), frame, notes)


def _partner(path: Path, ending: Literal[".hdr", ".img"]) -> Path:
    """Return where a pair's header or values are; the file itself where it is alone."""
    if not is_paired(path.name):
        return path
    packed = ".gz" * path.name.lower().endswith(".gz")
    stem = path.name[: len(path.name) - len(packed) - len(ending)]
    plain, other = path.with_name(stem + ending), path.with_name(f"{stem}{ending}.gz")
    named = path.name[len(stem) :].lower()
    if named == ending + packed:
        return path
    return plain if plain.exists() or not other.exists() else other


def _header(path: Path) -> "Nifti1Header":
    from nibabel import Nifti1Header, Nifti2Header

    with opened(path) as file:
        content = file.read(max(HEADER_BYTES))
    orders: tuple[Literal["little", "big"], ...] = ("little", "big")
    for order in orders:
        size = int.from_bytes(content[:4], order)
        if size not in HEADER_BYTES or len(content) < size:
            continue
        kind = Nifti1Header if HEADER_BYTES[size] == 1 else Nifti2Header
        header = kind(content[:size], endianness=order, check=False)
        dimensions = int(header["dim"][0])
        if not 1 <= dimensions <= MOST_DIMENSIONS:
            raise UserError(f"{path} is no NIfTI file: it says {dimensions} dimensions")
        return header
    raise UserError(f"{path} is no NIfTI file: its header has no known length")


def _placed(
    path: Path, header: "Nifti1Header", size: list[int]
) -> tuple[NDArray[np.float64], list[str]]:
    """Choose a file's frame, and tell what else the file says of its place."""
    frames = {}
    if header["sform_code"] > 0:
        _check_finite(path, header, "sform", "srow_x", "srow_y", "srow_z")
        frames["sform"] = header.get_sform()
    if header["qform_code"] > 0:
        quaternion = [f"quatern_{letter}" for letter in "bcd"]
        offset = [f"qoffset_{letter}" for letter in "xyz"]
        _check_finite(path, header, "qform", *quaternion, *offset)
        if not np.isfinite(header["pixdim"][:4]).all():
            raise UserError(_not_finite(path, "qform"))
        frames["qform"] = header.get_qform()
    if not frames:
        raise UserError(
            f"{path} does not say how it lies in the patient (qform and sform are "
            "0), so left and right are unknown; convert the DICOM images again"
        )
    scale = UNITS_MM.get(header.get_xyzt_units()[0], 1.0)
    placed = {n: scale * _LPS_FROM_RAS @ frame[:3] for n, frame in frames.items()}
    name, taken = next(iter(placed.items()))
    notes = []
    if len(placed) == 2:
        apart = _apart_mm(placed["qform"], placed["sform"], size)
        if apart > AGREEING_MM:
            _check_sides(path, placed["qform"], placed["sform"])
            notes.append(
                f"qform and sform of {path.name} disagree by up to {apart:.1f} mm: the "
                f"{name} is taken"
            )
    told = scale * np.asarray(header["pixdim"][1:4], np.float64)
    steps = np.linalg.norm(taken[:, :3], axis=0)
    apart = float((np.abs(steps - told) * size[:3]).max()) if len(size) > 2 else 0.0
    if not notes and not apart <= AGREEING_MM:
        notes.append(
            f"pixdim of {path.name} says voxels of {_listed(told)} mm, its {name} of "
            f"{_listed(steps)} mm: the {name} is taken"
        )
    if scale != 1.0:
        unit = header.get_xyzt_units()[0]
        notes.append(f"{path.name} is in units of {unit}: it is read in millimetres")
    return taken, notes


def _listed(numbers: NDArray[np.float64]) -> str:
    return " x ".join(f"{v:.4g}" for v in numbers)


def _check_finite(path: Path, header: Any, frame: str, *fields: str) -> None:
    if not all(np.isfinite(header[field]).all() for field in fields):
        raise UserError(_not_finite(path, frame))


def _not_finite(path: Path, frame: str) -> str:
    return (
        f"{path} has a {frame} with numbers that are not finite, so its place is "
        "unknown; convert the DICOM images again"
    )


def _check_sides(
    path: Path, one: NDArray[np.float64], other: NDArray[np.float64]
) -> None:
    with np.errstate(divide="ignore", invalid="ignore"):
        ways = [f[:, :3] / np.linalg.norm(f[:, :3], axis=0) for f in (one, other)]
    if not (np.sum(ways[0] * ways[1], axis=0) >= SAME_SIDE).all():
        raise UserError(
            f"{path} has a qform and an sform that name different sides of the "
            "patient, so left and right are unknown; convert the DICOM images again"
        )


def _apart_mm(
    one: NDArray[np.float64], other: NDArray[np.float64], size: list[int]
) -> float:
    """Return how far two frames put a corner of the volume apart."""
    ends = [[0, n - 1] for n in (*size, 1, 1)[:3]]
    corners = np.array(np.meshgrid(*ends)).reshape(3, 8)
    away = (one - other) @ np.vstack([corners, np.ones(8)])
    return float(np.linalg.norm(away, axis=0).max())


def _read(path: Path, start: int, need: int) -> bytes:
    """Read a file's values; no more than is claimed is ever unpacked."""
    try:
        with opened(path) as file:
            file.seek(start)
            content = file.read(need)
    except (EOFError, OSError, zlib.error) as error:
        raise UserError(f"{path} is cut off or damaged: {error}") from error
    if len(content) < need:
        raise UserError(
            f"{path} is cut off: {len(content):,} of {need:,} bytes are there"
        )
    return content
