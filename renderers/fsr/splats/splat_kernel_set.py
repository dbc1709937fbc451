"""Which compiled functions draw splats on this machine."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from renderers.simd_guard import vector_problem


@dataclass(frozen=True, slots=True)
class KernelSet:
    """Hold what culls a set, what draws lists, and what does both.

    All sets give equal bits.
    """

    list_strip: Callable[..., tuple[Any, ...]]
    draw_pieces: Callable[..., tuple[int, int]]
    list_and_draw: Callable[..., tuple[int, int, int, int, int, int]]


def scalar_kernels() -> KernelSet:
    """Give the functions that every machine compiles."""
    from renderers.fsr.kernels.cull_and_draw_scalar import list_and_draw
    from renderers.fsr.kernels.cull_view_scalar import list_strip
    from renderers.fsr.kernels.draw_pass_scalar import draw_pieces

    return KernelSet(list_strip, draw_pieces, list_and_draw)


def best_kernels() -> KernelSet:
    """Give vector functions where they can be trusted, else scalar ones."""
    if vector_problem():
        return scalar_kernels()
    from renderers.fsr.kernels.cull_and_draw import list_and_draw
    from renderers.fsr.kernels.cull_view import list_strip
    from renderers.fsr.kernels.draw_pass import draw_pieces

    return KernelSet(list_strip, draw_pieces, list_and_draw)
