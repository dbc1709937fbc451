"""The page's colours; the tests compute how well one can be read on another."""

from enum import StrEnum


class Colour(StrEnum):
    """Name the colours. Shapes, dashes and words tell again what a colour tells."""

    PAPER = "#ffffff"
    PANEL = "#f3f5f7"
    INK = "#1b1f24"
    QUIET = "#545d68"
    LINE = "#7b8490"
    LINK = "#0b4f9e"
    GOOD = "#1a6b3c"
    WARNING = "#8a4b00"
    DANGER = "#a3151f"
    OWN = "#0b4f9e"
    OTHER = "#a14a00"
    CUT = "#7a3d8c"
    BLOOD = "#b0202b"
    FROZEN = "#5c6672"
    TASK = "#1a6b3c"
    CONTACT = "#8a6100"


HAZARD_LINES = (
    *(Colour.OWN, Colour.OTHER, Colour.CUT, Colour.GOOD, Colour.DANGER),
    *(Colour.CONTACT, Colour.QUIET, Colour.INK),
)
"""Of hazards in a figure, with a dash of their own each."""
