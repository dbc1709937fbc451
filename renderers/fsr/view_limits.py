"""What culling allows for at the edges of a view."""

import math

SOFT_PX = 2.0
"""More than the softening of footprints adds to their reach: 3 sqrt(.3) at most."""

STEEPEST_CONE_RAD = math.radians(89.0)
"""A wider cone is not convex or nearly flat: nothing is culled sideways then."""
