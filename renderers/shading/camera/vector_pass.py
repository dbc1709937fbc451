"""The camera's picture by vector kernels: exposed, then swept once, band by band."""

from collections.abc import Iterator
from contextlib import contextmanager
from queue import SimpleQueue

import numpy as np
from numpy.typing import NDArray

from renderers.shading.bands import RowBands
from renderers.shading.camera.exposed_picture import ExposedPicture
from renderers.shading.camera.grain import grain_offset, grain_tile
from renderers.shading.camera.optics import Lateral, Optics
from renderers.shading.kernels.camera_expose import expose_rows
from renderers.shading.kernels.camera_sweep import W as LANES
from renderers.shading.kernels.camera_sweep import sweep_rows
from renderers.shading.kernels.camera_tone import W as TONE_LANES

_LEAST_ROWS = 96
"""Of a band of the sweep: every band makes a dozen rows again that another has made."""


class SweptCamera:
    """Make pictures of one size, one at a time."""

    def __init__(self, optics: Optics, bands: RowBands, seed: int) -> None:
        self.optics = optics
        self._bands = bands
        height, width = optics.height, optics.width
        reach = _reach(optics)
        self._margin = _whole(reach)
        self._small_margin = _whole(len(optics.halo_taps))
        pitch = _whole(width) + 2 * self._margin
        small_pitch = _whole(-(-width // 4)) + 2 * self._small_margin
        small_rows = -(-height // 4)
        self._exposed = _aligned(height, 3 * pitch)
        self._glare = _aligned(small_rows, 3 * small_pitch)
        self._is_lit = np.zeros(small_rows, np.uint8)
        self._white = np.float32(1 if optics.has_bloom else np.inf)
        self._lateral = (*self._along(optics.red), *self._along(optics.blue))
        self._vignette = self._padded(optics.vignette)
        self._stop = self._padded(optics.stop)
        self._spans = self._field_spans(reach)
        grain = grain_tile(seed)
        # a vector may start in the last column
        self._grain = np.concatenate([grain, grain[..., :TONE_LANES]], axis=2)
        far = 1 + max(_steps(optics.red[1]), _steps(optics.blue[1]))
        # one set of scratch rows a thread
        self._spare: SimpleQueue[_Scratch] = SimpleQueue()
        for _ in range(bands.threads):
            self._spare.put(_Scratch(optics, 2 * far + 2, pitch, small_pitch))

    def expose(
        self,
        radiance: NDArray[np.float32],
        depth_mm: NDArray[np.float32],
        gain: float,
        frame_number: int,
    ) -> ExposedPicture:
        """Expose a picture; not from two threads at once."""
        optics = self.optics
        radiance = _read_only(radiance)
        depth_mm = _read_only(depth_mm)
        row, column = grain_offset(frame_number)
        picture = np.empty((optics.height, optics.width, 3), np.uint8)

        def expose_band(first: int, last: int) -> None:
            with self._scratch() as scratch:
                expose_rows(
                    radiance,
                    np.float32(gain),
                    self._white,
                    *self._lateral,
                    self._margin,
                    self._small_margin,
                    scratch.raw,
                    scratch.total,
                    self._exposed,
                    self._glare,
                    self._is_lit,
                    first,
                    last,
                )

        def sweep(first: int, last: int) -> None:
            with self._scratch() as scratch:
                sweep_rows(
                    self._exposed,
                    self._glare,
                    self._is_lit,
                    optics.halo_taps,
                    optics.soft_taps,
                    optics.rest_taps,
                    optics.spacing,
                    depth_mm,
                    self._vignette,
                    self._stop,
                    self._grain,
                    row,
                    column,
                    optics.tone,
                    self._spans,
                    self._margin,
                    self._small_margin,
                    scratch.work,
                    scratch.small,
                    scratch.glow,
                    scratch.line,
                    scratch.codes,
                    picture,
                    first,
                    last,
                )

        self._bands.run(len(self._is_lit), expose_band)
        return ExposedPicture(picture, sweep, _LEAST_ROWS)

    @contextmanager
    def _scratch(self) -> Iterator["_Scratch"]:
        scratch = self._spare.get()
        try:
            yield scratch
        finally:
            self._spare.put(scratch)

    def _along(
        self, lateral: tuple[Lateral, Lateral]
    ) -> tuple[
        NDArray[np.int32], NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]
    ]:
        columns, rows = lateral
        # the last vector of a run may begin at its last pixel
        part = np.concatenate([columns.part, np.zeros(LANES, np.float32)])
        return columns.runs(), part, rows.index, rows.part

    def _padded(self, table: NDArray[np.float32]) -> NDArray[np.float32]:
        """Give a table of pixels the margins of the planes, of zeros."""
        height, width = table.shape
        padded = _aligned(height, self._exposed.shape[1] // 3)
        padded[:, self._margin : self._margin + width] = table
        return padded

    def _field_spans(self, reach: int) -> NDArray[np.int64]:
        """Give the part of each row that the stop leaves, and what that depends on."""
        is_seen = self._stop > 0
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


class _Scratch:
    """Hold the rows one thread works on."""

    def __init__(
        self, optics: Optics, source_rows: int, pitch: int, small_pitch: int
    ) -> None:
        soft = len(optics.soft_taps) - 1
        rest = (len(optics.rest_taps) - 1) * optics.spacing
        rings = (soft + rest + 1) + (2 * soft + 1) + 2 * (2 * rest + 1)
        self.raw = _aligned(source_rows, 3 * pitch)
        self.total = _aligned(1, 3 * pitch)
        self.work = _aligned(rings, 3 * pitch)
        self.small = _aligned(2 * len(optics.halo_taps), 3 * small_pitch)
        self.glow = _aligned(3, 3 * pitch + 4 * LANES)
        self.line = _aligned(5, pitch)
        self.codes = np.zeros((3, pitch), np.uint8)


def _reach(optics: Optics) -> int:
    """Give how far a picture's pixel depends on exposed ones."""
    return len(optics.soft_taps) - 1 + (len(optics.rest_taps) - 1) * optics.spacing


def _steps(rows: Lateral) -> int:
    """Give by how many rows at most a channel is shifted."""
    return int(np.abs(rows.index - np.arange(len(rows.index))).max())


def _whole(count: int) -> int:
    """Round up to whole vectors."""
    return -(-count // LANES) * LANES


def _aligned(*shape: int) -> NDArray[np.float32]:
    """Give zeros that begin where a line of the cache does."""
    size = int(np.prod(shape))
    memory = np.zeros(size + 16, np.float32)
    start = -memory.ctypes.data % 64 // 4
    return memory[start : start + size].reshape(shape)


def _read_only(array: NDArray[np.float32]) -> NDArray[np.float32]:
    """View an array so that it cannot be written: another type would be compiled."""
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view
