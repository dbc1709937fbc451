"""How much is traced between two looks at whether the picture is still wanted."""

from renderers.art.quality import Quality

RAYS_A_SLICE = 65536
"""Rays in packets run between two looks at the progress, at most: 6 MB."""

SLICE_S = 0.04
"""Time between two looks that is aimed at: whoever cancels does not wait for longer."""

FINE_STEP = 0.25
FEWEST_RAYS = 256
MOST_RAYS = 16384
"""Nothing can interrupt a packet. One of 8192 rays took up
to .002 s at steps of 1/4 voxel; at 1/32 one of 4096 took up to .08 s, one of 256 up to
.008 (phantom at .5 mm, a view from inside, one thread). Small ones cost: with 256 rays
in place of 1,448, at 1/13 voxel, a picture took 1.1 to 1.4 times as long, and on two
threads 1.3 to 2.1 times."""

FIRST_BLOCKS = 2
"""Blocks a thread draws before anything is known of how long one takes."""

FASTER = 8
"""Times as many blocks as before, at most."""


def rays_a_packet(quality: Quality) -> int:
    """Choose how many rays move together, where one process draws all of them."""
    fine = min(quality.step_voxels / FINE_STEP, 1.0)
    return max(int(MOST_RAYS * fine**2), FEWEST_RAYS)


def next_slice(packets: int, spent_s: float, threads: int, rays: int) -> int:
    """Choose how many packets to run before the next look, after so many took so long.

    rays: of a packet. All threads get one; the picture does not depend on it.
    """
    if spent_s > SLICE_S:
        packets //= 2
    elif spent_s < SLICE_S / 4:
        packets *= 2
    return max(min(packets, RAYS_A_SLICE // rays), threads)


def next_blocks(blocks: int, spent_s: float, threads: int) -> int:
    """Choose how many blocks to draw at once before the next look; as `next_slice`."""
    wanted = SLICE_S * blocks / max(spent_s, 1e-9)
    return int(max(min(wanted, FASTER * blocks), threads))
