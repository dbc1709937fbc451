"""The outside of the whole head: the face, closed by skull, jaw, ears and neck.

In a sinus scan's field of view only the face is near, and there the outside is that of
`outside` to the bit: blends by the quadratic smooth minimum end at their
width.
"""

from anatomy.phantom.shapes import (
    Chain,
    Ellipsoid,
    Field,
    Table,
    U,
    depth_table,
    height_table,
    shifted,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)

NECK_END_MM = -118.0
"""Height at which the neck is cut off."""

WHOLE_HEAD_MM = ((-87.0, 87.0), (-33.0, 196.0), (-124.0, 162.0))
"""LPS x, y, z ranges that hold the whole head of scale 1, with room around it."""


def head_outside() -> Field:
    """Build the air around the whole head, negative outside."""
    bounded = smooth_min(6.0, outside(), -_bounds())
    faced = smooth_max(9.0, smooth_min(2.0, bounded, _mouth()), -_chin())
    return smooth_max(3.0, faced, -_ears())


def _bounds() -> Field:
    """Build what closes the face's prism: it lies outside of the face itself."""
    half = abs(u)
    cranium = smooth_min(
        20.0,
        Ellipsoid((0, -80, 76), (76, 101, 80)),
        Ellipsoid((0, -112, 70), (75, 78, 76)),
    )
    # Cheeks and jaw: sides that converge to the chin, a rear, a lower edge that
    # rises from chin to angle.
    side = half - height_table(
        [-75, -60, -35, 0, 40, 80], [30, 41, 57, 66, 68, 66], 12.0
    )
    edge = depth_table([-20, 0, 40, 75, 120], [-69, -68, -56, -36, -10], 10.0)
    lower = smooth_max(10.0, side, (edge - z) * 0.9, -102.0 - y)
    lower = smooth_max(8.0, lower, z - 84.0)
    # The face's prism ends at 64 mm: from there the temples run on to the ears.
    temple = 0.97 * (half - 65.0) + 0.2 * (y + 46.0) + 0.05 * (z - 80.0)
    cranium = smooth_max(24.0, cranium, temple)
    neck = smooth_max(
        2.0,
        Chain(((0, -98, 10), (0, -100, -60), (0, -106, -150)), (52.0, 53.0, 62.0)),
        NECK_END_MM - z,
    )
    return smooth_min(22.0, smooth_min(14.0, cranium, lower), neck)


def _mouth() -> Field:
    """Build the air before lips and chin, which the face leaves as a block."""
    profile = height_table(
        [-66, -56, -47, -38, -30, -26, -23.5, -20.5, -16],
        [2.0, 4.5, 4.0, 2.5, 6.0, 7.0, 4.5, 7.6, 7.0],
        2.0,
    )
    # The corners of the mouth lie further back.
    corner = Table(
        U, (-36, -24, -12, 0, 12, 24, 36), (-12, -6, -1.2, 0, -1.2, -6, -12), 4.0
    )
    return smooth_max(2.0, z + 18.0, (profile + corner - y) * 0.7)


def _chin() -> Field:
    return Ellipsoid((0, -4, -55), (18, 12, 11))


def _ears() -> Field:
    shell = Ellipsoid((73, -97, 22), (8.5, 16, 30))
    hollow = Ellipsoid((84, -93, 20), (8, 8, 15))
    ear = smooth_max(3.0, shell, -hollow, 58.0 - u)
    # Both sides of the nose see the whole outside: u may be negative here.
    return shifted(ear, abs(u) - u, 0.0)


RIM_OFFSET_MM = 12.64
"""The nostrils' plane, ``0.8 y - 0.6 z > RIM_OFFSET_MM`` below the nose; its slope is
that of a nasal tip lifted as for surgery."""


def outside() -> Field:
    """Build the air in front of the face and below the lifted nasal tip."""
    half = abs(u)
    cheek = Table(
        U,
        (-64, -52, -44, -30, -20, -12, 0, 12, 20, 30, 44, 52, 64),
        (-52, -26, -14, -5, 0, 4, 5, 4, 0, -5, -14, -26, -52),
        3.0,
    )
    brow = height_table([28, 38, 50, 60, 70], [0, 2.0, 4.0, 7.0, 7.5], 3.0)
    ridge = height_table(
        [-2, 6, 11, 18, 31, 42, 50, 58], [16, 18, 16.5, 11, 4.5, 0.5, 0, 0], 2.0
    )
    width = height_table([0, 10, 20, 40], [0.058, 0.07, 0.1, 0.13], 3.0)
    t = half * width
    profile = smooth_max(0.6, 1.0 - t * t, 0.0)
    # The eye lies in a hollow, under closed lids; the lips stand out.
    hollow = Table(U, (10, 16, 24, 36, 46), (0, -4, -5, -4, 0), 3.0) * height_table(
        [24, 33, 45, 55], [0.0, 1.0, 1.0, 0.0], 4.0
    )
    lid = Table(U, (20, 26, 31, 36, 42), (0, 3.2, 4.2, 3.2, 0), 3.0) * height_table(
        [28, 34, 38, 42, 48], [0.0, 0.8, 1.0, 0.8, 0.0], 3.0
    )
    lips = Table(U, (0, 8, 16, 25), (8.0, 7.0, 3.5, 0), 3.0) * height_table(
        [-32, -26, -23, -20, -16, -12], [0.0, 1.0, 0.7, 1.0, 0.6, 0.0], 1.5
    )
    front = cheek + brow + hollow + lid + lips + ridge * profile
    face = (front - y) * 0.6
    lip = height_table([-14, -9, -4], [9.0, 8.0, 8.0], 2.0)
    below = smooth_max(
        2.0, RIM_OFFSET_MM - (0.8 * y - 0.6 * z), lip - (half * half) * 0.006 - y
    )
    return smooth_min(1.5, face, below)
