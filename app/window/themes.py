"""The window's themes: which colours there are, and that they can be read.

What means something is told apart by Okabe and Ito's palette, whose colours differ for
every kind of colour vision (https://jfly.uni-koeln.de/color/), made darker on a light
ground until it can be read. Never by colour alone: a word or a shape stands beside it.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Theme:
    """A theme's colours, ``#rrggbb``.

    background, panel: grounds. edge: lines, and the ground of bars. ink, quiet: text.
    ready: done, or going on. caution, warning, alarm: ever more urgent.
    """

    background: str
    panel: str
    edge: str
    ink: str
    quiet: str
    ready: str
    caution: str
    warning: str
    alarm: str

    @property
    def texts(self) -> tuple[str, ...]:
        """Return every colour that something is written in."""
        said = self.ready, self.caution, self.warning, self.alarm
        return self.ink, self.quiet, *said


DARK = "dark"
LIGHT = "light"
HIGH_CONTRAST = "high contrast"

THEMES = {
    DARK: Theme(
        background="#0d1117",
        panel="#161b22",
        edge="#30363d",
        ink="#f0f3f6",
        quiet="#9aa4af",
        ready="#2bb98c",
        caution="#e69f00",
        warning="#e8711a",
        alarm="#ff6f3c",
    ),
    LIGHT: Theme(
        background="#f3f5f7",
        panel="#ffffff",
        edge="#d0d7de",
        ink="#14181d",
        quiet="#4c555e",
        ready="#00694d",
        caution="#7d5600",
        warning="#a84a00",
        alarm="#b03a00",
    ),
    HIGH_CONTRAST: Theme(
        background="#000000",
        panel="#000000",
        edge="#5a5a5a",
        ink="#ffffff",
        quiet="#e8e8e8",
        ready="#56c8f4",
        caution="#f0e442",
        warning="#ffb000",
        alarm="#ff9060",
    ),
}
"""By the name that a person chooses. Dark, because the picture is what one looks at."""


def contrast(one: str, other: str) -> float:
    """Return the contrast of two ``#rrggbb`` colours, 1 to 21, as WCAG 2.2 defines it.

    Text needs 4.5, with enhanced contrast 7; what is no text needs 3.
    """
    lighter, darker = sorted((_luminance(one), _luminance(other)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


def _luminance(colour: str) -> float:
    """Return the relative luminance of WCAG 2.2."""
    shares = (int(colour[n : n + 2], 16) / 255.0 for n in (1, 3, 5))
    linear = [
        share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4
        for share in shares
    ]
    red, green, blue = linear
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
