"""The Fuzzy-Set Renderer: splats, for the live picture.

`SplatActor` shows them in VTK, which is loaded when it is first asked for.
"""

from typing import TYPE_CHECKING

from renderers.fsr.fuzzy_set import (
    FuzzySet,
    Inclusion,
    extract_fuzzy_set,
    update_fuzzy_set,
)
from renderers.fsr.renderer import FuzzySetRenderer, render_among
from renderers.fsr.splats import SplatMode, Traversal

if TYPE_CHECKING:
    from renderers.fsr.actor import SplatActor
else:

    def __getattr__(name: str) -> object:
        if name != "SplatActor":
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from renderers.fsr.actor import SplatActor

        return SplatActor


__all__ = [
    "FuzzySet",
    "FuzzySetRenderer",
    "Inclusion",
    "SplatActor",
    "SplatMode",
    "Traversal",
    "extract_fuzzy_set",
    "render_among",
    "update_fuzzy_set",
]
