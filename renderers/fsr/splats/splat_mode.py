"""How splats are drawn: fast, or right; and in which order."""

from enum import Enum


class SplatMode(Enum):
    """Name a way to draw splats, the fastest first.

    POINTS: squares of one opacity and one voxel's size; sheets of them show gaps and
    overlaps, only their mean is right. GAUSSIAN: every splat blended by itself, its
    peak such that a sheet has the right mean opacity, ripple up to six codes. SHEET:
    optical depth summed over layers of a quarter of a voxel, each blended as a whole;
    ripple below one code.
    """

    POINTS = "points"
    GAUSSIAN = "gaussian"
    SHEET = "sheet"


class Traversal(Enum):
    """Name an order of splats.

    DISTANCE: from the eye, counted, not compared; does not change when the eye only
    turns. GRID: that of 1995, slices, rows and columns from the far side to the eye's
    own, which needs no sort; in a perspective view wide footprints of that slice shine
    through nearer walls beside them.
    """

    DISTANCE = "distance"
    GRID = "grid"
