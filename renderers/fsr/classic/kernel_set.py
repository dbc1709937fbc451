"""Which compiled functions draw splats on this machine."""

from collections.abc import Callable
from dataclasses import dataclass

from renderers.simd_guard import vector_problem


@dataclass(frozen=True, slots=True)
class KernelSet:
    """Hold what projects splats and composites a tile's.

    All sets give equal bits.
    """

    project_splats: Callable[..., tuple[int, int]]
    draw_tile: Callable[..., int]
    draw_sheets: Callable[..., int]


def scalar_kernels() -> KernelSet:
    """Give the functions that every machine compiles."""
    from renderers.fsr.classic.kernels import draw_sheets, draw_tile
    from renderers.fsr.classic.projection.kernels import project_splats

    return KernelSet(project_splats, draw_tile, draw_sheets)


def best_kernels() -> KernelSet:
    """Give vector functions where they can be trusted, else scalar ones."""
    if vector_problem():
        return scalar_kernels()
    from renderers.fsr.classic.projection.vector.kernels import project_splats
    from renderers.fsr.classic.vector.kernels import draw_sheets, draw_tile

    return KernelSet(project_splats, draw_tile, draw_sheets)
