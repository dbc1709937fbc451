"""Which cells packets of rays visit in an orbit around a volume."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Orbit:
    """Look at a cube of `side` voxels from outside, parallel rays, frame by frame.

    side: voxels. cell: voxels along a cell. image: pixels along a picture, which shows
    `spread` times the volume's edge: by default the whole of it from all around.
    packet: pixels along a packet. step_deg: turn from frame to frame. Nothing is empty
    and rays do not end early. thin: of so many rays each way, and voxels along them,
    one is followed; it stands for all.
    """

    side: int = 128
    cell: int = 8
    image: int = 256
    packet: int = 8
    step_deg: float = 3.0
    elevation_deg: float = 20.0
    spread: float = math.sqrt(2)
    thin: int = 2

    @property
    def cells(self) -> int:
        """Count the cells."""
        return (self.side // self.cell) ** 3

    @property
    def packets(self) -> int:
        """Count the packets of a frame."""
        return (self.image // self.packet) ** 2

    def frame(self, number: int) -> "FrameTrace":
        """Trace one frame."""
        right, up, forward = self._axes(number)
        per = self.side // self.cell
        centres = (np.arange(per) + 0.5) * self.cell - self.side / 2
        z, y, x = np.meshgrid(centres, centres, centres, indexing="ij")
        depth = (x * forward[0] + y * forward[1] + z * forward[2]).ravel()
        return FrameTrace(*self._visits(right, up, forward), depth)

    def _axes(self, number: int) -> tuple[NDArray[np.float64], ...]:
        turn = math.radians(number * self.step_deg)
        high = math.radians(self.elevation_deg)
        forward = np.array(
            [
                -math.cos(high) * math.cos(turn),
                -math.cos(high) * math.sin(turn),
                -math.sin(high),
            ]
        )
        right = np.array([-math.sin(turn), math.cos(turn), 0.0])
        return right, np.cross(right, forward), forward

    def _visits(
        self,
        right: NDArray[np.float64],
        up: NDArray[np.float64],
        forward: NDArray[np.float64],
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], int]:
        """Count samples by packet and cell, one a voxel."""
        wide = self.image // self.packet
        thin = self.thin
        found: list[tuple[NDArray[np.int64], ...]] = []
        crossings = 0
        for row, index, within in self._rows(right, up, forward):
            entered = within.copy()
            entered[..., 1:] &= (index[..., 1:] != index[..., :-1]) | ~within[..., :-1]
            crossings += int(entered.sum()) * thin * thin
            packet = np.broadcast_to(np.arange(wide)[:, None, None, None], index.shape)
            key = packet[within].astype(np.int64) * self.cells + index[within]
            counts = np.bincount(key, minlength=wide * self.cells)
            hit = np.flatnonzero(counts)
            numbers = hit // self.cells + row * wide
            found.append((numbers, hit % self.cells, counts[hit] * thin**3 // 2))
        packets, cells, samples = (
            np.concatenate(part) for part in zip(*found, strict=True)
        )
        return packets, cells, samples, crossings

    def _rows(
        self,
        right: NDArray[np.float64],
        up: NDArray[np.float64],
        forward: NDArray[np.float64],
    ) -> Iterator[tuple[int, NDArray[np.int32], NDArray[np.bool_]]]:
        """Follow rays, a row of packets at a time: number, each sample's cell, whether
        it is inside; (packet, ray across, ray down, sample)."""
        wide = self.image // self.packet
        pixel = self.side * self.spread / self.image
        thin = self.thin
        inside = (np.arange(0, self.packet, thin) + thin / 2) * pixel
        reach = self.side * self.spread / 2
        along = np.arange(-reach, reach, self.thin / 2)
        per = self.side // self.cell
        for row in range(wide):
            v = (row * self.packet) * pixel + inside - reach
            u = np.arange(wide)[:, None] * (self.packet * pixel) + inside - reach
            index: NDArray[np.int32] | None = None
            within: NDArray[np.bool_] | None = None
            for axis in (2, 1, 0):
                at = (
                    u[:, :, None, None] * right[axis]
                    + v[None, None, :, None] * up[axis]
                    + along * forward[axis]
                    + self.side / 2
                )
                ok = (at >= 0) & (at < self.side)
                part = (at * (1 / self.cell)).astype(np.int32)
                index = part if index is None else index * per + part
                within = ok if within is None else within & ok
            assert index is not None
            assert within is not None
            yield row, index, within


class FrameTrace:
    """The visits of a frame: for each packet its cells, front to back.

    samples: by visit. crossings: visits of cells by single rays.
    """

    def __init__(
        self,
        packets: NDArray[np.int64],
        cells: NDArray[np.int64],
        samples: NDArray[np.int64],
        crossings: int,
        depth: NDArray[np.float64],
    ) -> None:
        # Front to back by centres: each step of a ray from cell to cell leads to one
        # whose centre lies further along the view.
        order = np.lexsort((depth[cells], packets))
        self.crossings = crossings
        self.samples = int(samples.sum())
        self._packets = packets[order]
        self._cells = cells[order]
        self._samples = samples[order]

    def __iter__(self) -> Iterator[tuple[int, list[int], NDArray[np.int64]]]:
        """Return each packet that meets the volume: number, cells, samples in each."""
        numbers, starts = np.unique(self._packets, return_index=True)
        ends = np.append(starts[1:], len(self._packets))
        for number, a, b in zip(numbers, starts, ends, strict=True):
            yield int(number), self._cells[a:b].tolist(), self._samples[a:b]
