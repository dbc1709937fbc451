"""The rows of marks that parts leave at a point."""

from enum import IntEnum


class Row(IntEnum):
    """Name the rows of marks; the kernels know the same numbers."""

    INFERIOR = 0
    MIDDLE = 1
    SUPERIOR = 2
    UNCINATE = 3
    TORUS = 4
    POLYP = 5
    PHARYNX = 6
    OUTSIDE = 7
    SINUS = 8
    SEPTUM = 9
    SKIN = 10
    REAR = 11
    FACE = 12
    BASE = 13
    FIRST_GROUND = 14
