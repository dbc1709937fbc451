"""Parts of the screen: who draws which, and how they become one picture again."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.art.ranks.messages import ProtocolError
from renderers.scene import GBuffer

REGION_PX = 32
"""Edge of a region. Large enough that its rays share cells (1.9 fetches of each cell
over 8 ranks, against 3.2 at 16), small enough to balance (mean load .98 of largest)."""

_HEADER = np.dtype([("left", "<i4"), ("top", "<i4"), ("right", "<i4"), ("low", "<i4")])


@dataclass(frozen=True, slots=True)
class Region:
    """Bound a rectangle of pixels: columns left to right, rows top to bottom."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def rows(self) -> slice:
        """Return the rows as a slice."""
        return slice(self.top, self.bottom)

    @property
    def columns(self) -> slice:
        """Return the columns as a slice."""
        return slice(self.left, self.right)

    @property
    def pixels(self) -> int:
        """Count the pixels."""
        return (self.right - self.left) * (self.bottom - self.top)


LONE_REGION_PX = 64
"""Edge of a region where nobody shares the picture: fewer, for what each costs."""

STRIP_PX = 8
"""Smallest height of a strip: the packets' tiles are squares of so many pixels."""


def skew_of(ranks: int) -> int:
    """Return the shift of the deal from one row of regions to the next.

    About .618 of the ranks, and without a common divisor, so that the shifted rows run
    through all ranks.
    """
    return min(
        (s for s in range(ranks + 1) if math.gcd(s, ranks) == 1),
        key=lambda s: abs(s - 0.618 * ranks),
    )


def region_edge(ranks: int) -> int:
    """Return the pixels along a region that suit a number of ranks."""
    return LONE_REGION_PX if ranks == 1 else REGION_PX


def finished_squares(done: NDArray[np.bool_], edge: int) -> NDArray[np.bool_]:
    """Tell which regions of an edge have all their rays, by row and column.

    done: as of `Gather`.
    """
    height, width = done.shape
    rows = np.logical_and.reduceat(done, range(0, height, edge), axis=0)
    squares: NDArray[np.bool_]
    squares = np.logical_and.reduceat(rows, range(0, width, edge), axis=1)
    return squares


def deal_regions(
    width: int,
    height: int,
    rank: int,
    ranks: int,
    edge: int | None = None,
    finished: NDArray[np.bool_] | None = None,
) -> list[Region]:
    """Return the regions of one rank, in skewed cyclic order.

    edge: pixels along a region; None for what suits the number of ranks. finished: the
    regions that nobody need draw, as `finished_squares` tells them.

    Row by row would put whole columns of regions on one rank when the row length
    divides by the number of ranks; each row is therefore shifted by about .618 of it.
    """
    shift = skew_of(ranks)
    edge = edge or region_edge(ranks)
    return [
        Region(x, y, min(x + edge, width), min(y + edge, height))
        for ty, y in enumerate(range(0, height, edge))
        for tx, x in enumerate(range(0, width, edge))
        if (tx + shift * ty) % ranks == rank
        and not (finished is not None and finished[ty, tx])
    ]


def strips(done: NDArray[np.bool_], pixels: int) -> list[Region]:
    """Cut what is not done of a picture into strips of about so many pixels.

    For a picture that nobody shares. As wide as it where they can be: their rays then
    lie in a row everywhere. done: as of `Gather`.
    """
    height, width = done.shape
    columns = min(width, max(pixels // STRIP_PX**2, 1) * STRIP_PX)
    rows = max(pixels // columns // STRIP_PX, 1) * STRIP_PX
    return [
        Region(x, y, min(x + columns, width), min(y + rows, height))
        for y in range(0, height, rows)
        for x in range(0, width, columns)
        if not done[y : y + rows, x : x + columns].all()
    ]


class Gather:
    """Collect finished regions into one picture.

    value: ``(h, w, 4)`` float32. depth: ``(h, w)`` float32, +inf where nothing is.
    done: ``(h, w)`` whether a ray has come. wanted: ``(h, w)`` rays asked
    for, the others may find nothing; None for all. solids: what rays end at, if there
    is any; value and depth are of what lies before.
    """

    def __init__(self, width: int, height: int, *, filled: bool = True) -> None:
        """Begin. filled: else its memory is not written, and `fill` has to be called.

        A picture has a thousand pages, to write which takes a millisecond.
        """
        shape = height, width
        self.value = np.empty((*shape, 4), np.float32)
        self.depth = np.empty(shape, np.float32)
        self.done = np.zeros(shape, np.bool_)
        self.missing = width * height
        self.wanted: NDArray[np.bool_] | None = None
        self.solids: GBuffer | None = None
        if filled:
            self.fill()

    def fill(self) -> None:
        """Show nothing where no ray has come."""
        if self.missing == self.done.size:
            self.value.fill(0)
            self.depth.fill(np.inf)
        elif self.missing:
            self.value[~self.done] = 0
            self.depth[~self.done] = np.inf

    def count(self) -> None:
        """Count the rays that are missing anew."""
        self.missing = self.done.size - int(np.count_nonzero(self.done))

    def add(
        self,
        region: Region,
        value: NDArray[np.float32],
        depth: NDArray[np.float32],
        rest: NDArray[np.float32] | None = None,
    ) -> None:
        """Place a region's rays, listed row by row; value and rest are added up."""
        shape = (region.bottom - region.top, region.right - region.left)
        here = region.rows, region.columns
        if rest is None:
            self.value[here] = value.reshape(*shape, 4)
        else:
            np.add(
                value.reshape(*shape, 4), rest.reshape(*shape, 4), out=self.value[here]
            )
        self.depth[here] = depth.reshape(shape)
        self.missing -= region.pixels - int(np.count_nonzero(self.done[here]))
        self.done[here] = True

    def add_payload(self, payload: bytes) -> None:
        """Place a region that came as a message; raise ProtocolError if it is odd."""
        if len(payload) < _HEADER.itemsize:
            raise ProtocolError("a region came without its bounds")
        head = np.frombuffer(payload, _HEADER, count=1)[0]
        region = Region(*(int(head[name]) for name in ("left", "top", "right", "low")))
        height, width = self.depth.shape
        inside = 0 <= region.left < region.right <= width
        if not (inside and 0 <= region.top < region.bottom <= height):
            raise ProtocolError(f"{region} lies outside {width} x {height} pixels")
        n = region.pixels
        if len(payload) != _HEADER.itemsize + 20 * n:
            raise ProtocolError(f"{region} came with {len(payload)} bytes")
        numbers = np.frombuffer(payload, "<f4", offset=_HEADER.itemsize)
        self.add(region, numbers[: 4 * n], numbers[4 * n :])


def split_regions(payloads: bytes) -> Iterator[bytes]:
    """Part what several calls of `region_payload` wrote, one behind the other."""
    at = 0
    while at < len(payloads):
        start = payloads[at : at + _HEADER.itemsize]
        head = np.frombuffer(start.ljust(_HEADER.itemsize), _HEADER)[0]
        wide, high = head["right"] - head["left"], head["low"] - head["top"]
        size = _HEADER.itemsize + 20 * max(int(wide), 0) * max(int(high), 0)
        yield payloads[at : at + size]
        at += size


def region_payload(
    region: Region, value: NDArray[np.float32], depth: NDArray[np.float32]
) -> bytes:
    """Write what `Gather.add_payload` reads."""
    head = np.array([(region.left, region.top, region.right, region.bottom)], _HEADER)
    parts = (np.ascontiguousarray(part, "<f4").data for part in (value, depth))
    return b"".join((head.tobytes(), *parts))
