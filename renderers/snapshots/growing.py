"""A picture while it is drawn: coarse at first, then sharp, part by part.

The worker replaces one file; the client reads it whenever it is another one. It holds
a checksum, then the pixels as a ``.npy`` record. One that a crash of the machine
damaged is never shown.
"""

import io
import os
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderers.art.job_steps import Step, reached
from renderers.snapshots.data_store import npy_record, write_whole
from renderers.snapshots.spool import Spool
from system import UserError, foreign_file

FILE_NAME = "growing.picture"

Pixels = NDArray[np.uint8]


def show(folder: Path, pixels: Pixels) -> None:
    """Show ``(h, w, 3)`` pixels in an attempt's folder."""
    record = npy_record(pixels)
    whole = b"".join((_checksum(record), record))
    try:
        write_whole(folder / FILE_NAME, whole, lasting=False)
    except OSError:
        # The picture does not need it, and not every system replaces an open file.
        return
    reached(Step.TILE_SHOWN)


class GrowingPicture:
    """Read what there is of a job's picture.

    pixels: ``(h, w, 3)`` uint8 sRGB, black as long as nothing came.
    """

    def __init__(self, spool: Spool, job_id: str, width: int, height: int) -> None:
        self.pixels: Pixels = np.zeros((height, width, 3), np.uint8)
        self._spool = spool
        self._job_id = job_id
        self._read: tuple[Path, int, int] | None = None

    def update(self) -> bool:
        """Read what came since the last call; return whether anything did."""
        path = self._spool.attempt_folder(self._job_id) / FILE_NAME
        try:
            with foreign_file(path, "a picture"), path.open("rb") as file:
                info = os.fstat(file.fileno())
                found = path, info.st_ino, info.st_mtime_ns
                if found == self._read:
                    return False
                self._read = found
                checksum, record = file.read(4), file.read()
                if checksum != _checksum(record):
                    return False
                self.pixels = np.load(io.BytesIO(record), allow_pickle=False)
        except (OSError, UserError):
            return False
        return True


def _checksum(record: bytes | memoryview) -> bytes:
    return zlib.crc32(record).to_bytes(4, "little")
