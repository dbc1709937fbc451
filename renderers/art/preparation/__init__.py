"""What is computed before rays march: bricks, empty space, the first samples."""

from renderers.art.preparation.kernels import (
    build_brick,
    chebyshev,
    find_clear,
    find_clear_cubes,
    set_up_rays,
    sum_blocks,
)

__all__ = [
    "build_brick",
    "chebyshev",
    "find_clear",
    "find_clear_cubes",
    "set_up_rays",
    "sum_blocks",
]
