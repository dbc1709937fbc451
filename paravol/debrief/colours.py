"""The page's colours, and how well one can be read on another."""

from enum import StrEnum

TEXT_CONTRAST = 4.5
"""Least contrast of text with what is behind it (WCAG 2.1, 1.4.3, level AA)."""

GRAPHIC_CONTRAST = 3.0
"""Least contrast of what a figure is read by (WCAG 2.1, 1.4.11)."""


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


BACKGROUNDS = Colour.PAPER, Colour.PANEL
TEXTS = (
    *(Colour.INK, Colour.QUIET, Colour.LINK, Colour.GOOD, Colour.WARNING),
    *(Colour.DANGER, Colour.OWN, Colour.OTHER),
)
GRAPHICS = (
    *(Colour.LINE, Colour.OWN, Colour.OTHER, Colour.CUT, Colour.BLOOD),
    *(Colour.FROZEN, Colour.TASK, Colour.CONTACT, Colour.DANGER, Colour.WARNING),
)
HAZARD_LINES = (
    *(Colour.OWN, Colour.OTHER, Colour.CUT, Colour.GOOD, Colour.DANGER),
    *(Colour.CONTACT, Colour.QUIET, Colour.INK),
)
"""Of hazards in a figure, with a dash of their own each."""


def unreadable() -> list[tuple[Colour, Colour, float]]:
    """Return what cannot be read well enough: colour, background, contrast."""
    return [
        (colour, behind, found)
        for colours, least in ((TEXTS, TEXT_CONTRAST), (GRAPHICS, GRAPHIC_CONTRAST))
        for colour in colours
        for behind in BACKGROUNDS
        if (found := contrast(colour, behind)) < least
    ]


def contrast(one: str, other: str) -> float:
    """Return the contrast ratio of two colours ``#rrggbb``, 1 to 21 (WCAG 2.1)."""
    light, dark = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(colour: str) -> float:
    shares = [int(colour[n : n + 2], 16) / 255.0 for n in (1, 3, 5)]
    # the threshold is WCAG's own, not sRGB's
    linear = [
        s / 12.92 if s <= 0.03928 else ((s + 0.055) / 1.055) ** 2.4 for s in shares
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
