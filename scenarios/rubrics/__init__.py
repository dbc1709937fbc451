"""Rubrics: how the metrics of a session become points, as data."""

from scenarios.rubrics.assessment import (
    Assessment,
    Band,
    HardFail,
    Part,
    Standing,
    Verdict,
)

__all__ = ["Assessment", "Band", "HardFail", "Part", "Standing", "Verdict"]
