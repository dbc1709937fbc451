"""Signs of a touch: shares, words and what is not known."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.feedback.touch_signs import (
    FELT_N,
    FULL_N,
    MARGIN_MM,
    NO_SIGNS,
    UNKNOWN,
    Strain,
    TouchSigns,
)
from scenarios.instruments.catalogue import MOST_N, USUAL_N

forces = st.floats(0.0, 60.0)


@given(forces, st.floats(0.5, 30.0))
def test_the_share_is_of_the_force_that_breaks_the_wall(
    force_n: float, limit_n: float
) -> None:
    signs = TouchSigns(force_n, "lamina papyracea", limit_n)
    share = min(force_n / limit_n, 1.0) if force_n >= FELT_N else 0.0
    assert signs.share == share
    words = {0.0: Strain.NONE}.get(
        share,
        Strain.LOW if share < 0.5 else Strain.HIGH if share < 0.8 else Strain.BREAKING,
    )
    assert signs.strain is words


@given(forces, forces, st.floats(0.5, 30.0))
def test_more_force_never_tells_less(one: float, other: float, limit_n: float) -> None:
    low, high = (TouchSigns(f, "wall", limit_n) for f in sorted((one, other)))
    order = list(Strain)
    assert low.share <= high.share
    assert order.index(low.strain) <= order.index(high.strain)


def test_what_does_not_break_is_told_on_the_whole_scale() -> None:
    signs = TouchSigns(FULL_N / 2, "mucosa")
    assert signs.share == 0.5
    assert signs.force_text() == "10.0 N, mucosa"


@given(forces)
def test_where_nothing_breaks_a_press_is_judged_by_what_is_usual(
    force_n: float,
) -> None:
    """13.3 N on mucosa were called low: a scope is pressed with 8.0 N at most."""
    word = TouchSigns(force_n, "mucosa").strain
    if force_n < FELT_N:
        assert word is Strain.NONE
    elif force_n <= USUAL_N:
        assert word is Strain.LOW
    else:
        assert word is (Strain.HIGH if force_n <= MOST_N else Strain.EXCESSIVE)
    assert TouchSigns(13.3, "mucosa").strain is Strain.EXCESSIVE


def test_the_wall_and_its_break_force_are_named() -> None:
    # a lamina breaks as an ethmoid cell does: only its name tells them apart
    lamella = TouchSigns(3.04, "ethmoid lamella", 6.06)
    lamina = TouchSigns(3.04, "lamina papyracea", 6.13)
    assert lamella.force_text() == "3.0 of 6.1 N, ethmoid lamella"
    assert lamina.force_text() == "3.0 of 6.1 N, lamina papyracea"
    broken = TouchSigns(0.0, breaks=1, broken="lamina papyracea", broken_n=6.13)
    assert broken.break_text() == ("Broken: lamina papyracea", "It gave way at 6.1 N.")


def test_a_hazard_is_told_by_name_and_distance() -> None:
    near = TouchSigns(hazard=("orbit", 1.24))
    assert near.hazard_text() == "1.2 mm to orbit"
    assert near.is_near_hazard
    assert TouchSigns(hazard=("orbit", -0.6)).hazard_text() == "0.6 mm inside orbit"
    assert not TouchSigns(hazard=("orbit", MARGIN_MM)).is_near_hazard


def test_what_is_not_known_is_not_invented() -> None:
    assert (NO_SIGNS.force_text(), NO_SIGNS.hazard_text()) == (UNKNOWN, UNKNOWN)
    assert (NO_SIGNS.share, NO_SIGNS.strain) == (0.0, Strain.NONE)
    assert NO_SIGNS.hazard_mm == math.inf
    assert TouchSigns(hazard=("orbit", math.nan)).hazard_mm == math.inf


@pytest.mark.parametrize("force", [math.nan, math.inf, -math.inf])
def test_a_force_that_is_no_number_presses_nothing(force: float) -> None:
    signs = TouchSigns(force, "wall", 6.0)
    assert signs.share == 0.0
    assert signs.force_text() == "0.0 N"
    assert TouchSigns(3.0, "wall", 0.0).share == 0.0
