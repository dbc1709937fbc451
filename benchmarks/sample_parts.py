"""How long the reads of one sample take alone, from the nearest caches."""

from functools import cache, partial

import numpy as np

from benchmarks.kernels.read_samples import (
    read_distances,
    read_gradients,
    read_lines,
    read_values,
)
from benchmarks.timing import measure

_EDGE = 16
_LANES = 1 << 14
_BINS = 1024
_REPEATS = 100
"""Each takes some hundredths of a millisecond; of 15 the least was up to 1.2 times that
of 100 on a busy machine."""


@cache
def sample_parts_ns(gradients: bool) -> float:
    """Measure ns a sample without or with gradients, one thread.

    What no march of packets can leave out, each read by itself with nothing else to
    wait for: the sample's cell, its bin, and the distance at the next. 16 voxels cubed,
    int16, fit the nearest caches. The distances that leaps read beside are left out.
    """
    random = np.random.default_rng(0)
    inner = random.integers(0, _EDGE - 1, (3, _LANES))
    corners = ((inner[0] * _EDGE + inner[1]) * _EDGE + inner[2]).astype(np.int32)
    parts = random.random(3 * _LANES, np.float32)
    values = random.integers(-999, 999, _EDGE**3).astype(np.int16)
    lines = random.random((_BINS, 8), np.float32)
    bins = random.integers(0, _BINS, _LANES).astype(np.int32)
    distances = np.zeros(_EDGE**3 + 4, np.uint8)
    out = np.empty(_LANES, np.float32)
    place = corners, parts, _EDGE, _EDGE**2, out
    cell = partial(read_values, values, *place)
    if gradients:
        cell = partial(read_gradients, np.repeat(values, 4), *place)
    calls = (
        cell,
        partial(read_lines, lines, bins, out),
        partial(read_distances, distances, corners, out),
    )
    return sum(
        1e9 * measure(call, least=_REPEATS, most=_REPEATS)[0].cpu_s / _LANES
        for call in calls
    )
