"""A picture while it is drawn: coarse at first, then sharp, part by part.

The worker appends records to one file; the client reads on from where it stopped. A
record is a block of sRGB pixels and the rectangle of the finished picture that it
stands for. One that was cut off, by a worker that died, is never shown.
"""

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from renderers.art.job_steps import Step, reached
from renderers.art.regions import Region
from renderers.snapshots.spool import Spool

FILE_NAME = "growing.tiles"

TILE_PX = 64
"""Edge of the parts that are shown."""

_HEADER = struct.Struct("<8I")
"""Magic, left, top, right, bottom, width and height of the block, CRC of all else."""
_WORDS = struct.Struct("<7I")
_MAGIC = 0x4C495431

Pixels = NDArray[np.uint8]


class TileWriter:
    """Append blocks to an attempt's file."""

    def __init__(self, folder: Path) -> None:
        self._file = (folder / FILE_NAME).open("ab")

    def add(self, region: Region, pixels: Pixels) -> None:
        """Show ``(h, w, 3)`` pixels, the region's own or coarser ones, in a region."""
        height, width, _ = pixels.shape
        block = pixels.tobytes()
        sides = region.left, region.top, region.right, region.bottom
        words = _MAGIC, *sides, width, height
        crc = zlib.crc32(block, zlib.crc32(_WORDS.pack(*words)))
        self._file.write(_HEADER.pack(*words, crc) + block)
        self._file.flush()
        reached(Step.TILE_SHOWN)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class GrowingPicture:
    """Read what there is of a job's picture.

    pixels: ``(h, w, 3)`` uint8 sRGB, black where nothing came yet.
    """

    def __init__(self, spool: Spool, job_id: str, width: int, height: int) -> None:
        self.pixels: Pixels = np.zeros((height, width, 3), np.uint8)
        self._spool = spool
        self._job_id = job_id
        self._path = Path()
        self._read = 0

    def update(self) -> bool:
        """Read what came since the last call; return whether anything did."""
        path = self._spool.attempt_folder(self._job_id) / FILE_NAME
        if path != self._path:
            # Another worker took the job over and shows it from the beginning.
            self._path, self._read = path, 0
        try:
            with path.open("rb") as file:
                file.seek(self._read)
                fresh = file.read()
        except FileNotFoundError:
            return False
        used = 0
        while (end := self._take(fresh, used)) > used:
            used = end
        self._read += used
        return used > 0

    def _take(self, fresh: bytes, at: int) -> int:
        """Show the record that begins at `at`; return its end, or `at` if it has none.

        A record that is wrong, rather than unfinished, is where reading ends for good.
        """
        start = at + _HEADER.size
        if len(fresh) < start:
            return at
        head: tuple[int, ...] = _HEADER.unpack_from(fresh, at)
        magic, left, top, right, bottom, width, height, crc = head
        rows, columns, _ = self.pixels.shape
        inside = left < right <= columns and top < bottom <= rows
        fits = 0 < width <= right - left and 0 < height <= bottom - top
        end = start + 3 * width * height
        if magic != _MAGIC or not (inside and fits) or len(fresh) < end:
            return at
        block = fresh[start:end]
        if zlib.crc32(block, zlib.crc32(_WORDS.pack(*head[:-1]))) != crc:
            return at
        pixels = np.frombuffer(block, np.uint8).reshape(height, width, 3)
        self.pixels[top:bottom, left:right] = _spread(
            pixels, right - left, bottom - top
        )
        return end


def _spread(pixels: Pixels, width: int, height: int) -> Pixels:
    """Enlarge a block, smoothly, to a rectangle's size."""
    if pixels.shape == (height, width, 3):
        return pixels
    from PIL import Image as PngImage

    size, filter_ = (width, height), PngImage.Resampling.BILINEAR
    return np.asarray(PngImage.fromarray(pixels).resize(size, filter_))
