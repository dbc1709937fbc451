"""Exercises, screens and processes for the tests of commands and the window."""

from tests.flights import (
    coarse_scenario,
    family,
    screen,
    screen_of,
    shifted_file,
    short_scenario,
    train,
)

__all__ = [
    "coarse_scenario",
    "family",
    "screen",
    "screen_of",
    "shifted_file",
    "short_scenario",
    "train",
]
