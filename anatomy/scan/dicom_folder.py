"""The files of an examination's folder, and none from elsewhere."""

import warnings
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from renderers.scene.memory_limit import memory_limit
from system import UserError, foreign_file

if TYPE_CHECKING:
    from pydicom import Dataset

MOST_FILES = 20_000
"""A head at 0.3 mm has about a thousand slices."""

PREAMBLE_BYTES, MAGIC = 128, b"DICM"

FIRST_GROUPS, LAST_FIRST_ELEMENT, LONGEST_FIRST = (0x0002, 0x0008), 0x0018, 256
"""What a file without preamble begins with: one of these groups, an element up to that
of its identity, and a value no longer than so many bytes."""

DEFLATED, MOST_META_BYTES = b"1.2.840.10008.1.2.1.99", 4096
"""The encoding whose values are packed, and where a header names it."""

CHUNK_BYTES = 1 << 20


def examination_files(folder: Path) -> list[Path]:
    """List the files below a folder, in a fixed order.

    A link to a file of the same folder is passed over, for the file is there. Raises
    UserError for more than 20,000 files, and for a link that leads out of the folder,
    nowhere, or in a circle.
    """
    inside = folder.resolve()
    files = []
    for entry in sorted(folder.rglob("*")):
        if entry.is_symlink():
            _check_link(entry, inside)
        elif entry.is_file():
            files.append(entry)
        if len(files) > MOST_FILES:
            raise UserError(
                f"{folder} holds more than {MOST_FILES:,} files; name the folder of "
                "one examination"
            )
    return files


def _check_link(link: Path, inside: Path) -> None:
    try:
        target = link.resolve(strict=True)
    except (OSError, RuntimeError) as error:
        raise UserError(
            f"{link} is a link that leads nowhere or in a circle; remove it"
        ) from error
    if not target.is_relative_to(inside):
        raise UserError(
            f"{link} is a link that leads out of the folder, to {target}; copy into "
            "the folder what belongs to the examination, and remove the link"
        )


def is_dicom(file: Path) -> bool:
    """Return whether a file is DICOM, by its first bytes.

    Older archives wrote it without the preamble that says so. Such a file begins with
    the group that tells what it is.
    """
    head = _head(file, PREAMBLE_BYTES + len(MAGIC))
    return head[PREAMBLE_BYTES:] == MAGIC or _is_bare(head)


def _head(file: Path, size: int) -> bytes:
    with foreign_file(file, "a DICOM file"), file.open("rb") as opened:
        return opened.read(size)


def _is_bare(head: bytes) -> bool:
    """Return whether bytes are the first element of a DICOM file without preamble."""
    orders: tuple[Literal["little", "big"], ...] = ("little", "big")
    for order in orders:
        group, element = (int.from_bytes(head[n : n + 2], order) for n in (0, 2))
        if group not in FIRST_GROUPS or element > LAST_FIRST_ELEMENT:
            continue
        # its kind in two letters, or without it the length of a short value
        if head[4:6].isalpha() and head[4:6].isupper():
            return True
        if order == "little" and 0 < int.from_bytes(head[4:8], order) <= LONGEST_FIRST:
            return True
    return False


def read_dicom(file: Path, *, pixels: bool = True) -> "Dataset":
    """Read a DICOM file with pydicom, with preamble or without; pixels: their bytes.

    A file that does not say how it is encoded has ``TransferSyntaxUID`` as it was found
    to be. Raises UserError naming a file that is damaged, or that unpacks to more than
    memory holds.
    """
    import pydicom

    # what matters of a value is told in our words; pydicom's are lines of the terminal
    warnings.filterwarnings("ignore", module="pydicom")
    with foreign_file(file, "a DICOM file"):
        _check_deflated(file)
        image = pydicom.dcmread(file, stop_before_pixels=not pixels, force=True)
        if "TransferSyntaxUID" not in image.file_meta:
            implicit, little = image.original_encoding
            image.file_meta.TransferSyntaxUID = (
                pydicom.uid.ImplicitVRLittleEndian
                if implicit
                else pydicom.uid.ExplicitVRLittleEndian
                if little
                else pydicom.uid.ExplicitVRBigEndian
            )
        return image


def _check_deflated(file: Path) -> None:
    """Unpack a deflated file in pieces that are thrown away, and count them."""
    head = _head(file, PREAMBLE_BYTES + MOST_META_BYTES)
    start = PREAMBLE_BYTES + len(MAGIC)
    if head[PREAMBLE_BYTES:start] != MAGIC:
        start = 0
    # the first element of the header tells how many bytes of it follow
    begins = start + 12 + int.from_bytes(head[start + 8 : start + 12], "little")
    if DEFLATED not in head[start:begins]:
        return
    # several copies of what is unpacked are held at a time
    limit, have = memory_limit() // 4, 0
    with file.open("rb") as opened:
        opened.seek(begins)
        unpacker = zlib.decompressobj(-zlib.MAX_WBITS)
        packed = opened.read(CHUNK_BYTES)
        while packed and not unpacker.eof:
            have += len(unpacker.decompress(packed, CHUNK_BYTES))
            if have > limit:
                raise UserError(
                    f"{file} unpacks to more than {limit:,} bytes, the most that can "
                    "be read on this machine"
                )
            packed = unpacker.unconsumed_tail or opened.read(CHUNK_BYTES)
