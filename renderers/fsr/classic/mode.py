"""How splats are drawn: fast, or right."""

from enum import Enum


class SplatMode(Enum):
    """Name a way to draw splats, the fastest first.

    POINTS: squares of one opacity and one voxel's size; sheets of them show gaps and
    overlaps, only their mean is right. GAUSSIAN: every splat blended by itself, its
    peak such that a sheet has the right mean opacity, ripple up to six codes. SHEET:
    optical depth summed over layers of one voxel's thickness, each blended as a
    whole; ripple below one code.
    """

    POINTS = "points"
    GAUSSIAN = "gaussian"
    SHEET = "sheet"
