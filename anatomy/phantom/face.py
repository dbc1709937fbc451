"""The air in front of the face: nose, cheeks, eyes, lips and brow from outside."""

from anatomy.phantom.shapes import (
    Field,
    Table,
    U,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)

RIM_NORMAL = (0.0, 0.8, -0.6)
RIM_OFFSET_MM = 12.64
"""The nostrils' plane, points with ``RIM_NORMAL . p > RIM_OFFSET_MM`` below the nose;
its slope is that of a nasal tip lifted as for surgery."""


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
