"""Exercises, screens and processes for the tests of flights without a window."""

from tests.flights import (
    coarse_scenario,
    family,
    screen,
    shifted_file,
    short_scenario,
    train,
)

__all__ = [
    "coarse_scenario",
    "family",
    "screen",
    "shifted_file",
    "short_scenario",
    "train",
]
