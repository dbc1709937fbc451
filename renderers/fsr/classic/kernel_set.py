"""Which compiled functions draw splats on this machine."""

from collections.abc import Callable
from dataclasses import dataclass

from renderers.simd_guard import vector_problem


@dataclass(frozen=True, slots=True)
class KernelSet:
    """Hold what culls, lists and projects splats and composites tiles.

    All sets give equal bits.
    """

    clip_set: Callable[..., int]
    survey_spans: Callable[..., int]
    project_piece: Callable[..., None]
    draw_tiles: Callable[..., int]


def scalar_kernels() -> KernelSet:
    """Give the functions that every machine compiles."""
    from renderers.fsr.classic.kernels import draw_tiles
    from renderers.fsr.classic.pieces.kernels import project_piece
    from renderers.fsr.classic.survey.kernels import clip_set, survey_spans

    return KernelSet(clip_set, survey_spans, project_piece, draw_tiles)


def best_kernels() -> KernelSet:
    """Give vector functions where they can be trusted, else scalar ones."""
    if vector_problem():
        return scalar_kernels()
    from renderers.fsr.classic.pieces.vector.kernels import project_piece
    from renderers.fsr.classic.survey.vector.kernels import clip_set, survey_spans
    from renderers.fsr.classic.vector.kernels import draw_tiles

    return KernelSet(clip_set, survey_spans, project_piece, draw_tiles)
