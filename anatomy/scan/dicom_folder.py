"""The files of an examination's folder, and none from elsewhere."""

import os
import zlib
from pathlib import Path
from typing import TYPE_CHECKING

from disk import UserError, foreign_file
from renderers.scene.memory_limit import memory_limit

if TYPE_CHECKING:
    from pydicom import Dataset

MOST_FILES = 20_000
"""A head at 0.3 mm has about a thousand slices."""

PREAMBLE_BYTES, MAGIC = 128, b"DICM"

CHUNK_BYTES = 1 << 20


def examination_files(folder: Path) -> list[Path]:
    """List the files below a folder, in a fixed order.

    A link to a file of the same folder is passed over, for the file is there. Raises
    ValueError for more than 20,000 files, and for a link that leads out of the folder,
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
    """Return whether a file says that it is DICOM."""
    with foreign_file(file, "a DICOM file"), file.open("rb") as opened:
        return opened.read(PREAMBLE_BYTES + len(MAGIC))[PREAMBLE_BYTES:] == MAGIC


def read_dicom(file: Path, *, pixels: bool = True) -> "Dataset":
    """Read a DICOM file with pydicom; pixels: their bytes, too.

    Raises ValueError naming a file that is damaged, or that unpacks to more than
    memory holds.
    """
    import pydicom

    with foreign_file(file, "a DICOM file"):
        meta = pydicom.filereader.read_file_meta_info(file)
        deflated = pydicom.uid.DeflatedExplicitVRLittleEndian
        if meta.get("TransferSyntaxUID") == deflated:
            _check_deflated(file)
        return pydicom.dcmread(file, stop_before_pixels=not pixels)


def _check_deflated(file: Path) -> None:
    """Unpack a file in pieces that are thrown away, and count them."""
    # several copies of what is unpacked are held at a time
    limit, have = memory_limit() // 4, 0
    with file.open("rb") as opened:
        # the first element of the header tells how many bytes of it follow
        opened.seek(PREAMBLE_BYTES + len(MAGIC) + 8)
        header_bytes = int.from_bytes(opened.read(4), "little")
        opened.seek(header_bytes, os.SEEK_CUR)
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
