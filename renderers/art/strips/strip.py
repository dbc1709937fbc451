"""A strip of a picture, drawn at once: what is left of it for later.

A packet of rays for each strip would hold all that its rays have, written and read
again between one step of the work and the next: for a picture of 512 x 512 that took 3
to 5 ms of 11 to 40.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.art.rays import RayPacket, tile_order
from renderers.art.regions import Gather, Region
from renderers.art.views import BLOCK_COLUMNS, TILE_PX

_STRIDE = BLOCK_COLUMNS * TILE_PX + 1


@dataclass(frozen=True, slots=True)
class Strip:
    """Hold what drawing a strip left.

    packets: the rays of blocks that wait for cells, or of all that was not drawn at
    once. counters: of the kernels. fresh: pixels that are done now and were not before.
    early: rays in the picture now that ended before their way did.
    """

    packets: list[RayPacket]
    counters: NDArray[np.int64]
    fresh: int = 0
    early: int = 0


def draw_strip(
    kernel: Callable[..., tuple[int, int, int]],
    region: Region,
    rays: tuple[Any, ...],
    place: tuple[Any, ...],
    least_left: np.float32,
    gather: Gather,
    rest: tuple[Any, ...],
    counters: NDArray[np.int64],
    *,
    takes_along: bool,
) -> Strip:
    """Draw a region of a picture.

    kernel, rays, place, least_left, rest: as `strips.kernels` has them; counters are
    the last of the rest. takes_along: rays keep their last samples. What waits is not
    in the picture; its memory is a strip's.
    """
    columns = -(-(region.right - region.left) // BLOCK_COLUMNS)
    blocks = columns * -(-(region.bottom - region.top) // TILE_PX)
    rows = blocks * _STRIDE
    corners = np.empty((blocks, 2), np.int32)
    geometry = np.empty((rows, 8), np.float32)
    count = np.empty(rows, np.int32)
    state = np.empty((3, rows, 4), np.float32)
    cursor, value, carry = state[0].view(np.int32), state[1], state[2]
    depth = np.empty(rows, np.float32)
    front = np.empty((rows if takes_along else 0, 4), np.float32)
    kept, fresh, early = kernel(
        (region.left, region.top, region.right, region.bottom),
        rays,
        place,
        least_left,
        (corners, geometry, count, cursor, value, carry, depth, front),
        (gather.value, gather.depth, gather.done),
        (*rest, counters),
    )
    packets = []
    for k, (x, y) in enumerate(corners[:kept].tolist()):
        block = Region(
            x,
            y,
            min(x + BLOCK_COLUMNS, region.right),
            min(y + TILE_PX, region.bottom),
        )
        lone = slice(k * _STRIDE, k * _STRIDE + block.pixels)
        spared = slice(lone.start, lone.stop + 1)
        packets.append(
            RayPacket(
                block,
                tile_order(block.right - block.left, block.bottom - block.top),
                geometry[spared],
                count[lone],
                cursor[spared],
                value[spared],
                carry[spared],
                depth[lone],
                front=front[spared],
            )
        )
    return Strip(packets, counters, fresh, early)
