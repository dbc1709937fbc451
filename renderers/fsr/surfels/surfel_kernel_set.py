"""Which compiled functions draw surfels on this machine."""

from collections.abc import Callable
from dataclasses import dataclass

from renderers.simd_guard import vector_problem


@dataclass(frozen=True, slots=True)
class KernelSet:
    """Hold what a picture of surfels takes, stage by stage.

    Cones to where walls hide what is behind them, the surfels' projection, the tiles of
    the picture, and its rims. All sets give equal bits.
    """

    trace_cones: Callable[..., None]
    project_runs: Callable[..., int]
    draw_tiles: Callable[..., None]
    sharpen: Callable[..., tuple[int, int]]


def scalar_kernels() -> KernelSet:
    """Give the functions that every machine compiles."""
    from renderers.fsr.kernels.cones_scalar import trace_cones
    from renderers.fsr.kernels.draw_surfels_scalar import draw_tiles
    from renderers.fsr.kernels.project_surfels_scalar import project_runs
    from renderers.fsr.kernels.rims_scalar import sharpen

    return KernelSet(trace_cones, project_runs, draw_tiles, sharpen)


def best_kernels() -> KernelSet:
    """Give vector functions where they can be trusted, else scalar ones."""
    if vector_problem():
        return scalar_kernels()
    from renderers.fsr.kernels.cones import trace_cones
    from renderers.fsr.kernels.draw_surfels import draw_tiles
    from renderers.fsr.kernels.project_surfels import project_runs
    from renderers.fsr.kernels.rims import sharpen

    return KernelSet(trace_cones, project_runs, draw_tiles, sharpen)
