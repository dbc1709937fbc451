"""Every colour can be read on every background, by WCAG 2.1's own figures."""

import pytest

from paravol.debrief.colours import HAZARD_LINES, TEXTS, Colour, contrast, unreadable


def test_contrast_is_that_of_the_standard() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#ffffff", "#ffffff") == pytest.approx(1.0)
    # the grey that is known as the lightest one for text on white
    assert contrast("#767676", "#ffffff") >= 4.5 > contrast("#777777", "#ffffff")
    assert contrast("#123456", "#fedcba") == contrast("#fedcba", "#123456")


def test_all_colours_can_be_read() -> None:
    assert unreadable() == []


def test_lines_of_hazards_differ_and_are_seen() -> None:
    assert len(set(HAZARD_LINES)) == len(HAZARD_LINES)
    assert all(contrast(line, Colour.PAPER) >= 3.0 for line in HAZARD_LINES)
    assert Colour.QUIET in TEXTS
