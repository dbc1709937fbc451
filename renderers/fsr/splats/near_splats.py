"""Splats too near for one footprint, replaced by eight of half the size.

The projection of a footprint is made straight at its centre. That fails from an
angular sigma of about 0.1 on: at 0.2 the footprint is already a fifth too narrow. The
eight lie on a lattice of half the spacing and share the splat's extinction and
volume, so that what it hides stays the same. Parts lie at most half a voxel's diagonal
from their splat.
"""

WIDEST_SIGMA = 0.1
"""Angular sigma, in radians, above which a splat is split."""

LAST_SIGMA = 0.5
"""And above which one is left out that has been split often enough."""

SPLITS = 3
"""A splat of 0.3 mm sigma reaches 0.04 mm and is drawn from 0.08 mm on."""

NEAR_KEYS = 4096
"""Distances told apart by the order of near splats and parts."""

PARTS_REACH = 1.25
"""Distance of the farthest part of a near splat, in distances from which none is near.

That is six times the widest spacing or more, and parts lie within .87 of it.
"""
