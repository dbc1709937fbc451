"""How much is traced between two looks at whether the picture is still wanted."""

from renderers.art.quality import Quality

PACKETS_A_SLICE = 4
"""Packets run between two looks at the progress, at most."""

SLICE_S = 0.04
"""Time between two looks that is aimed at: whoever cancels does not wait for longer."""

FINE_STEP = 0.25
FINE_RAYS = 256
MOST_RAYS = 16384
"""Nothing can interrupt a packet. One of 8192 rays took up
to .002 s at steps of 1/4 voxel; at 1/32 one of 4096 took up to .08 s, one of 256 up to
.008 (phantom at .5 mm, a view from inside, one thread). With a quarter of it a picture
takes up to 1.2 times as long."""

FIRST_BLOCKS = 2
"""Blocks a thread draws before anything is known of how long one takes."""

FASTER = 8
"""Times as many blocks as before, at most."""


def rays_a_packet(quality: Quality) -> int:
    """Choose how many rays move together, where one process draws all of them."""
    return FINE_RAYS if quality.step_voxels < FINE_STEP else MOST_RAYS


def next_slice(packets: int, spent_s: float, threads: int) -> int:
    """Choose how many packets to run before the next look, after so many took so long.

    All threads get one; the picture does not depend on it.
    """
    if spent_s > SLICE_S:
        packets //= 2
    elif spent_s < SLICE_S / 4:
        packets *= 2
    return max(min(packets, PACKETS_A_SLICE), threads)


def next_blocks(blocks: int, spent_s: float, threads: int) -> int:
    """Choose how many blocks to draw at once before the next look; as `next_slice`."""
    wanted = SLICE_S * blocks / max(spent_s, 1e-9)
    return int(max(min(wanted, FASTER * blocks), threads))
