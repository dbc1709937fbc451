"""The Fuzzy-Set Renderer: splats, for the live picture."""

from renderers.fsr.composition import render_among
from renderers.fsr.fuzzy_set import (
    FuzzySet,
    Inclusion,
    extract_fuzzy_set,
    update_fuzzy_set,
)
from renderers.fsr.renderer import FuzzySetRenderer

__all__ = [
    "FuzzySet",
    "FuzzySetRenderer",
    "Inclusion",
    "extract_fuzzy_set",
    "render_among",
    "update_fuzzy_set",
]
