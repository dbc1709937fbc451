"""What the ray kernels take: rays, cells at hand, a transfer function, deflectors."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Lanes = Any
"""A vector of `renderers.simd`."""

Three = tuple[Lanes, Lanes, Lanes]
"""Vectors along x, y and z, or of red, green and blue."""

Line = tuple[Lanes, Lanes, Lanes, Lanes, Lanes, Lanes]
"""Places and vectors along x, y and z; or cubes, and how far in."""

End = tuple[Lanes, Lanes, Lanes, Lanes, Lanes]
"""Ends of segments: piece between nodes, extinction, red, green, blue."""

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

Samples = NDArray[np.float32] | NDArray[np.int16]
"""Values as cells keep them."""

ABSENT = np.int32(-(1 << 31))

TILE_PX = 8
"""Edge of the squares of pixels whose rays march together: they share cells."""

BLOCK_COLUMNS = 256
"""Pixels along a row of tiles whose rays are set up together."""


class RayArrays(NamedTuple):
    """Rays, one row per ray; state and `front` end with a spare row.

    order: int32, rays to march, neighbours after each other. geometry: float32 (n,
    8) origin x y z, step x y z in voxels, step in mm, distance of sample 0 in mm.
    samples: int32, how many. cursor: int32 (n + 1, 4) sample, stage, bracket, cell
    waited for + 1, or 0. In mode `classic` the stage is the sample at which opacity
    passed one half, + 1, or 0; the bracket is, if segments are integrated, twice
    the segment that the last sample begins, + 1 if that sample is not empty. value:
    float32 (n + 1, 4) r, g, b, alpha or normal, coverage. carry: float32 (n + 1,
    4), what adding to `value` has rounded away so far. depth: float32 (n,) mm.
    front: float32 (n + 1, 4) value and gradient of the last sample if segments are
    integrated, else without rows.
    """

    order: I32
    geometry: F32
    samples: I32
    cursor: I32
    value: F32
    carry: F32
    depth: F32
    front: F32


class CellView(NamedTuple):
    """Show the kernels which cells are here.

    top: int32 (3,) largest cube index along x, y, z. counts: int32 (3,) cells along
    x, y, z. leap: uint8, flat, every cube's Chebyshev distance in cubes to the next
    with something in it, and three bytes to spare. slots: int32 (cells,), negative
    when missing. corners: int32 (cells,), the number that voxel (0, 0, 0) would have
    among the samples if a cell's brick went on to it; ABSENT when missing. samples:
    flat, float32 or int16, ``(side + 1)**3`` voxels a slot. channels: numbers a voxel,
    4 (value, gradient x y z) or 1 (value) where no sample is shaded. whole: the
    volume's values, flat, where they are read without looking a cell up; else empty.
    unit: what an interpolated value is multiplied by.
    gradient_unit: likewise, to be per mm. stamp: int64 (slots,) time of last use.
    """

    top: I32
    counts: I32
    leap: NDArray[np.uint8]
    slots: I32
    corners: I32
    samples: Samples
    channels: int
    whole: Samples
    unit: np.float32
    gradient_unit: np.float32
    stamp: NDArray[np.int64]


class Classification(NamedTuple):
    """A transfer function as bins, each a straight line between its ends.

    A density v falls into bin ``(v - low) * scale + 1``; bin 0 is all below, bin `last`
    all above. lines: float32 (bins, 8): extinction per mm, its rise, red, its rise,
    green, its rise, blue, its rise; rises are per bin. Bins that hold one of the
    user's nodes between their ends have a negative extinction; there the segments
    between nodes count: first: int32 (bins,) the segment at a bin's
    lower end; extinction: float32 (n, 4) lower end of a segment, its upper end (+inf
    last), extinction per mm there, its slope. color, color_slope: float32 (n, 4)
    likewise; the last column is spare.
    """

    lines: F32
    low: np.float32
    scale: np.float32
    last: np.float32
    first: I32
    extinction: F32
    color: F32
    color_slope: F32


class ShadeSettings(NamedTuple):
    """What samples of mode `classic` are classified, lit and composited by.

    sums: float32 (pieces, 8), of `sums_at_nodes`; without rows where segments are not
    integrated. lights: float32 (m, 10) vector in mm along the array's axes, diffuse and
    specular colour, is local. material: float32 (3,) ambient, specular, shininess.
    spacing: float32 (3,) mm a voxel. A gradient below `least_gradient` gives no normal.
    A ray ends when its transmittance falls below `cutoff`, and is then divided by its
    opacity where `renormalise`.
    """

    table: Classification
    sums: F32
    lights: F32
    material: F32
    spacing: F32
    least_gradient: np.float32
    cutoff: np.float32
    renormalise: bool


class Deflectors(NamedTuple):
    """What bends rays.

    maps: float64 (n, 9), of `renderers.scene.deflection.maps`. stretch: mm that what is
    seen moves at most for a mm of the ray.
    """

    maps: F64
    stretch: float
    has_cut: bool


class DeflectedSamples(NamedTuple):
    """Where the samples of a packet of deflected rays are seen, lane by lane.

    kind: what samples are taken for. geometry: of `RayArrays`. spacing: of
    `ShadeSettings`. top, leap: of `CellView`. Read: ray int32 and at float32, the
    sample, for lanes where `on` is not 0. Written: cube int32 (3, width); part float32
    (3, width), how far in; jump int32, samples that surely lie in empty space; opening
    float32, mm to the nearest cut's face, negative in its gap; parted int32, 1 for a
    step that may cross a face; tissue float32 (2, width), of the halves of a step what
    is in no gap, .5 at most. gradient: float32 (3, width), turned by
    `deflect_gradients`. trail: float64 (width + 1, n, 3), where each map found a point.
    points: float64 (3, 3), scratch. found: int64 (1,), samples placed.
    """

    deflectors: Deflectors
    kind: int
    geometry: F32
    spacing: F32
    top: I32
    leap: NDArray[np.uint8]
    ray: I32
    at: F32
    on: I32
    cube: I32
    part: F32
    jump: I32
    opening: F32
    parted: I32
    tissue: F32
    gradient: F32
    trail: F64
    points: F64
    found: NDArray[np.int64]


class LensRays(NamedTuple):
    """A camera's rays: `Camera.lens_table`, mm to their ends, `Camera.frame`."""

    table: F32
    limit: F32
    frame: F64
    orthographic: bool


class RaySetUp(NamedTuple):
    """How rays are cut into steps.

    last: largest voxel index along x, y, z. at_ends: whether samples lie at the ends of
    steps. least_left: of a ray that did not end early.
    """

    voxel_from_world: F64
    last: F64
    step_mm: float
    at_ends: bool
    least_left: np.float32


class BlockMemory(NamedTuple):
    """The blocks that a thread keeps, int32, and room for the rays of so many."""

    waiting: I32
    rays: RayArrays


class PictureArrays(NamedTuple):
    """What a `Gather` has."""

    value: F32
    depth: F32
    done: NDArray[np.bool_]
