"""The pages' colours, and the templates in which they stand.

The tests compute how well one colour can be read on another.
"""

from enum import StrEnum
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

TEMPLATES = Path(__file__).parent / "templates"


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


def templates(*folders: Path) -> Environment:
    """Return the templates of folders: text is escaped, `colour` is the palette."""
    environment = Environment(
        loader=FileSystemLoader(folders),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # two names may be of one colour
    colours = {name.lower(): c.value for name, c in Colour.__members__.items()}
    environment.globals["colour"] = colours
    return environment
