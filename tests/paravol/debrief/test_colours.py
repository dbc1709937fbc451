"""Every colour can be read on every background, by WCAG 2.1's own figures."""

import re

import pytest

from paravol.debrief.colours import HAZARD_LINES, TEMPLATES, Colour

BACKGROUNDS = {Colour.PAPER, Colour.PANEL}
TEXTS = {
    *(Colour.INK, Colour.QUIET, Colour.LINK, Colour.GOOD, Colour.WARNING),
    Colour.DANGER,
}
TEXT_CONTRAST, GRAPHIC_CONTRAST = 4.5, 3.0
"""Least contrasts of level AA: 1.4.3 for text, 1.4.11 for what figures are read by."""


def luminance(colour: str) -> float:
    shares = [int(colour[n : n + 2], 16) / 255.0 for n in (1, 3, 5)]
    # the threshold is WCAG's own, not sRGB's
    red, green, blue = (
        s / 12.92 if s <= 0.03928 else ((s + 0.055) / 1.055) ** 2.4 for s in shares
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str) -> float:
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def test_contrast_is_that_of_the_standard() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#ffffff", "#ffffff") == pytest.approx(1.0)
    # the grey that is known as the lightest one for text on white
    assert contrast("#767676", "#ffffff") >= 4.5 > contrast("#777777", "#ffffff")


def test_all_colours_can_be_read() -> None:
    for colour in set(Colour) - BACKGROUNDS:
        least = TEXT_CONTRAST if colour in TEXTS else GRAPHIC_CONTRAST
        for behind in BACKGROUNDS:
            assert contrast(colour, behind) >= least, (colour, behind)


def test_the_style_sheet_writes_in_colours_for_text_only() -> None:
    sheet = (TEMPLATES / "page.css").read_text("utf-8")
    written = set(re.findall(r"[{;\s]color: {{ colour\.(\w+) }}", sheet))
    written |= set(re.findall(r"svg text[^{]*{[^}]*fill: {{ colour\.(\w+) }}", sheet))
    assert written
    assert {Colour[name.upper()] for name in written} <= TEXTS
    # no colour stands in the sheet itself
    assert not re.search(r"#[0-9a-f]{3,8}\b|rgb|hsl", sheet)


def test_lines_of_hazards_differ() -> None:
    assert len(set(HAZARD_LINES)) == len(HAZARD_LINES)
