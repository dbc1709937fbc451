"""Themes can be read, by everybody, and change in place."""

import itertools

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from PySide6.QtGui import QColor

from app.window.panels.slices_panel import MARK, PLACE_MARK, TOOL_MARK
from app.window.style import COLOURS, INK, OVER, style_sheet, take_theme
from app.window.themes import DARK, HIGH_CONTRAST, LIGHT, THEMES, contrast

TEXT, ENHANCED, GRAPHICS = 4.5, 7.0, 3.0
"""Least contrasts of WCAG 2.2: success criteria 1.4.3, 1.4.6 and 1.4.11."""


def test_the_contrast_is_that_of_the_standard() -> None:
    assert contrast("#000000", "#ffffff") == contrast("#ffffff", "#000000") == 21.0
    assert contrast("#123456", "#123456") == 1.0
    # the darkest grey that is enough on white, as the standard's own notes have it
    assert contrast("#767676", "#ffffff") == pytest.approx(4.54, abs=0.005)


@pytest.mark.parametrize("name", THEMES)
def test_every_text_can_be_read_on_every_ground(name: str) -> None:
    theme = THEMES[name]
    least = ENHANCED if name == HIGH_CONTRAST else TEXT
    for text, ground in itertools.product(theme.texts, (theme.background, theme.panel)):
        assert contrast(text, ground) >= least, (text, ground)
    # bars, on the ground of a bar
    for bar in (theme.ready, theme.caution, theme.warning, theme.quiet):
        assert contrast(bar, theme.edge) >= GRAPHICS


def test_what_is_marked_in_slices_differs_for_every_colour_vision() -> None:
    """Three of Okabe and Ito's colours; each mark has a shape of its own besides."""
    assert {MARK, PLACE_MARK, TOOL_MARK} == {"#f0e442", "#56b4e9", "#e69f00"}
    assert all(contrast(mark, "#000000") >= ENHANCED for mark in (MARK, PLACE_MARK))


def test_a_theme_changes_the_colours_that_are_held_already() -> None:
    try:
        for name in (LIGHT, HIGH_CONTRAST, DARK):
            take_theme(name)
            theme = THEMES[name]
            for part, colour in vars(COLOURS).items():
                assert colour == QColor(getattr(theme, part))
            assert QColor(theme.ink) == INK
            assert theme.ink in style_sheet(1.0)
            # pictures are dark in every theme
            over = OVER.ink.name(), OVER.background.name()
            assert contrast(*over) >= ENHANCED
    finally:
        take_theme(DARK)
