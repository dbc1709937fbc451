"""Which compiled functions draw surfels on this machine."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from renderers.simd_guard import vector_problem


@dataclass(frozen=True, slots=True)
class KernelSet:
    """Hold what projects surfels, lists a tile's, draws them and sharpens rims.

    All sets give equal bits.
    """

    project_runs: Callable[..., int]
    list_tile: Callable[..., int]
    draw_tile: Callable[..., Any]
    sharpen: Callable[..., tuple[int, int]]


def scalar_kernels() -> KernelSet:
    """Give the functions that every machine compiles."""
    from renderers.fsr.projection.kernels import project_runs
    from renderers.fsr.scope.kernels import draw_tile, list_tile
    from renderers.fsr.scope.rims.kernels import sharpen

    return KernelSet(project_runs, list_tile, draw_tile, sharpen)


def best_kernels() -> KernelSet:
    """Give vector functions where they can be trusted, else scalar ones."""
    if vector_problem():
        return scalar_kernels()
    from renderers.fsr.projection.vector.kernels import project_runs
    from renderers.fsr.scope.rims.vector.kernels import sharpen
    from renderers.fsr.scope.vector.kernels import draw_tile, list_tile

    return KernelSet(project_runs, list_tile, draw_tile, sharpen)
