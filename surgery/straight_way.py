"""Whether a hand came the straight way from one sample to the next.

What is measured of a tool are places; what it did between them is known only where a
hand can have gone straight on. A farther place means that the device was moved, or
lost and found: then nobody knows the way, and nothing is cut, hurt or felt on it.
"""

FASTEST_MM_S = 2000.0
"""No hand that operates moves so: nothing is cut or felt on a faster way."""

STRIKES_MM_S = 15000.0
"""No hand at all moves so: what lies on a slower way may have been hurt."""

SURE_MM = 5.0
"""So far a hand may always have come: samples do not arrive evenly."""


def is_way(
    moved_mm: float, elapsed_s: float, fastest_mm_s: float = FASTEST_MM_S
) -> bool:
    """Return whether a hand may have moved so far in that time.

    A way that nobody knows, NaN, is not said to be too long.
    """
    return not moved_mm > max(fastest_mm_s * elapsed_s, SURE_MM)
