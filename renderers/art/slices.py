"""How much is traced between two looks at whether the picture is still wanted."""

from renderers.art.quality import Quality
from renderers.art.regions import LONE_REGION_PX

PACKETS_A_SLICE = 8
"""Packets run between two looks at the progress, at most."""

SLICE_S = 0.04
"""Time between two looks that is aimed at: whoever cancels does not wait for longer."""

FINE_STEP = 0.25
FINE_REGION_PX = 16
"""Nothing can interrupt a packet. At steps of 1/32 voxel one of 64 x 64 rays took up to
.08 s, one of 16 x 16 up to .008 (phantom at .5 mm, a view from inside, one thread)."""


def lone_region_px(quality: Quality) -> int:
    """Choose the edge of a packet of rays, where one process draws all of them."""
    return FINE_REGION_PX if quality.step_voxels < FINE_STEP else LONE_REGION_PX


def next_slice(packets: int, spent_s: float, threads: int) -> int:
    """Choose how many packets to run before the next look, after so many took so long.

    All threads get one; the picture does not depend on it.
    """
    if spent_s > SLICE_S:
        packets //= 2
    elif spent_s < SLICE_S / 4:
        packets *= 2
    return max(min(packets, PACKETS_A_SLICE), threads)
