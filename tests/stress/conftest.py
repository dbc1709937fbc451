"""Exercises and screens for the stress of a window."""

from tests.flights import coarse_scenario, screen

__all__ = ["coarse_scenario", "screen"]
