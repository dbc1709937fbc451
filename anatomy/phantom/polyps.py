"""Nasal polyps: smooth clusters that grow out of the middle meatus."""

from anatomy.phantom.shapes import Ellipsoid, Field, smooth_min

# centre (u, y, z) and radii, in the order in which a polyposis grows; each row with
# the grade from which it is there
_GROWTH = (
    (1, (8.6, -27.0, 22.6), (1.9, 3.2, 1.8)),
    (1, (8.8, -32.5, 22.0), (1.9, 3.0, 2.0)),
    (2, (8.4, -25.0, 18.6), (2.3, 4.2, 2.6)),
    (2, (8.8, -32.5, 18.4), (2.3, 4.0, 2.4)),
    (3, (6.0, -21.0, 15.0), (2.4, 4.2, 4.6)),
    (3, (6.2, -30.0, 13.0), (2.4, 5.2, 5.4)),
    (3, (6.0, -38.0, 10.0), (2.2, 4.6, 4.4)),
    (4, (5.4, -15.0, 9.5), (2.8, 6.0, 7.5)),
    (4, (5.4, -25.0, 6.0), (3.4, 7.0, 5.0)),
    (4, (5.4, -36.0, 6.5), (3.6, 7.0, 5.5)),
    (4, (4.0, -28.0, 21.0), (2.4, 8.0, 6.0)),
)


def polyps(grade: int) -> Field | None:
    """Unite the polyps of a grade from 1 to 4; grade 0 has none."""
    grown = [
        Ellipsoid(center, radii) for from_, center, radii in _GROWTH if from_ <= grade
    ]
    return smooth_min(1.2, *grown) if grown else None
