"""From radiance to a picture of one size: exposed, then swept once, band by band."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from renderers.scene.gbuffer import read_only
from renderers.shading.bands import RowBands
from renderers.shading.camera.grain import grain_offset, grain_tile
from renderers.shading.camera.optics import Optics
from renderers.shading.kernels.camera_expose import Planes, expose_rows
from renderers.shading.kernels.camera_expose import W as LANES
from renderers.shading.kernels.camera_sweep import (
    SweepRows,
    SweepTables,
    sweep_rows,
)
from renderers.shading.kernels.camera_tone import W as TONE_LANES

Buffers = TypeVar("Buffers")

LEAST_ROWS = 96
"""Of a band of the sweep: every band makes a dozen rows again that another has made."""


class Developer:
    """Make pictures of one size, one at a time; hold their tables and buffers."""

    def __init__(self, optics: Optics, bands: RowBands, seed: int) -> None:
        self.optics = optics
        self._bands = bands
        height, width = optics.height, optics.width
        # how far a picture's pixel depends on exposed ones
        soft = len(optics.soft_taps) - 1
        rest = (len(optics.rest_taps) - 1) * optics.spacing
        self._margin = _whole(soft + rest)
        small_margin = _whole(len(optics.halo_taps))
        pitch = _whole(width) + 2 * self._margin
        small_pitch = _whole(-(-width // 4)) + 2 * small_margin
        small_rows = -(-height // 4)
        self._planes = Planes(
            _aligned(height, 3 * pitch),
            _aligned(small_rows, 3 * small_pitch),
            np.zeros(small_rows, np.uint8),
            self._margin,
            small_margin,
        )
        stop = self._padded(optics.stop)
        grain = grain_tile(seed)
        self._tables = SweepTables(
            self._padded(optics.vignette),
            stop,
            self._field_spans(stop, soft + rest),
            # a vector may start in the last column
            np.concatenate([grain, grain[..., :TONE_LANES]], axis=2),
            optics.tone,
            optics.soft_taps,
            optics.rest_taps,
            optics.spacing,
            optics.halo_taps,
        )
        far = 1 + max(_most_shift(optics.red.row), _most_shift(optics.blue.row))
        rings = (soft + rest + 1) + (2 * soft + 1) + 2 * (2 * rest + 1)
        # one set of scratch rows a thread
        self._raw: SimpleQueue[tuple[NDArray[np.float32], NDArray[np.float32]]]
        self._raw = SimpleQueue()
        self._rows: SimpleQueue[SweepRows] = SimpleQueue()
        for _ in range(bands.threads):
            self._raw.put((_aligned(2 * far + 2, 3 * pitch), _aligned(1, 3 * pitch)))
            self._rows.put(
                SweepRows(
                    _aligned(rings, 3 * pitch),
                    _aligned(2 * len(optics.halo_taps), 3 * small_pitch),
                    _aligned(3, 3 * pitch + 4 * LANES),
                    _aligned(5, pitch),
                    np.zeros((3, pitch), np.uint8),
                )
            )

    def expose(
        self,
        radiance: NDArray[np.float32],
        depth_mm: NDArray[np.float32],
        gain: float,
        frame_number: int,
    ) -> tuple[NDArray[np.uint8], Callable[[int, int], None]]:
        """Expose a picture; not from two threads at once.

        Gives its sRGB pixels ``(h, w, 3)``, and what makes rows ``first..last`` of
        them. All must be made before the next picture is exposed.
        """
        optics, planes = self.optics, self._planes
        radiance, depth_mm = read_only(radiance), read_only(depth_mm)
        white = np.float32(1 if optics.has_bloom else np.inf)
        row, column = grain_offset(frame_number)
        picture = np.empty((optics.height, optics.width, 3), np.uint8)

        def expose_band(first: int, last: int) -> None:
            with _borrowed(self._raw) as (raw, total):
                expose_rows(
                    radiance,
                    np.float32(gain),
                    white,
                    optics.red,
                    optics.blue,
                    planes,
                    raw,
                    total,
                    first,
                    last,
                )

        def sweep(first: int, last: int) -> None:
            with _borrowed(self._rows) as rows:
                sweep_rows(
                    planes,
                    depth_mm,
                    self._tables,
                    row,
                    column,
                    rows,
                    picture,
                    first,
                    last,
                )

        self._bands.run(len(planes.glare), expose_band)
        return picture, sweep

    def _padded(self, table: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a table of pixels with the margins of the planes, of zeros."""
        height, width = table.shape
        padded = _aligned(height, self._planes.exposed.shape[1] // 3)
        padded[:, self._margin : self._margin + width] = table
        return padded

    def _field_spans(self, stop: NDArray[np.float32], reach: int) -> NDArray[np.int64]:
        """Return the part of each row inside the stop, and what that depends on."""
        is_seen = stop > 0
        pitch = is_seen.shape[1]
        some = is_seen.any(axis=1)
        first = np.where(some, is_seen.argmax(axis=1), pitch // 2)
        past = np.where(some, pitch - is_seen[:, ::-1].argmax(axis=1), pitch // 2)
        edge = [(reach, reach)]
        windows = np.lib.stride_tricks.sliding_window_view
        low = windows(np.pad(first, edge, mode="edge"), 2 * reach + 1).min(axis=1)
        high = windows(np.pad(past, edge, mode="edge"), 2 * reach + 1).max(axis=1)
        width = _whole(self.optics.width)
        low = np.maximum(low - reach, self._margin)
        high = np.minimum(high + reach, self._margin + width)
        spans = [
            first // LANES * LANES,
            -(-past // LANES) * LANES,
            low // LANES * LANES,
            -(-high // LANES) * LANES,
        ]
        return np.ascontiguousarray(np.stack(spans, axis=1), dtype=np.int64)


@contextmanager
def _borrowed(spare: SimpleQueue[Buffers]) -> Iterator[Buffers]:
    buffers = spare.get()
    try:
        yield buffers
    finally:
        spare.put(buffers)


def _most_shift(rows: NDArray[np.int32]) -> int:
    """Return by how many rows at most a channel is shifted."""
    return int(np.abs(rows - np.arange(len(rows))).max())


def _whole(count: int) -> int:
    """Round up to whole vectors."""
    return -(-count // LANES) * LANES


def _aligned(*shape: int) -> NDArray[np.float32]:
    """Return zeros that begin at a cache line."""
    size = int(np.prod(shape))
    memory = np.zeros(size + 16, np.float32)
    start = -memory.ctypes.data % 64 // 4
    return memory[start : start + size].reshape(shape)
