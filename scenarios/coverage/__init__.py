"""Which mucosa and landmarks a scope really saw; docs/metrics.md says what counts."""

from scenarios.coverage.patches import Mucosa, mucosa_of
from scenarios.coverage.sites import SITE_NAMES
from scenarios.coverage.watch import (
    CoverageFigures,
    CoverageState,
    CoverageWatch,
    SeenPercent,
    SiteSeen,
)

__all__ = [
    "SITE_NAMES",
    "CoverageFigures",
    "CoverageState",
    "CoverageWatch",
    "Mucosa",
    "SeenPercent",
    "SiteSeen",
    "mucosa_of",
]
