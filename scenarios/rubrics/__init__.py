"""Rubrics: how the metrics of a session become points, as data; docs/scoring.md."""

from scenarios.rubrics.assess import Evidence, assess
from scenarios.rubrics.assessment import (
    Assessment,
    Band,
    HardFail,
    Part,
    Standing,
    Verdict,
)
from scenarios.rubrics.contrasting_groups import PassMark, pass_mark
from scenarios.rubrics.population import Population, load_population
from scenarios.rubrics.rubric import Rubric, load_rubric, shipped_rubrics

__all__ = [
    "Assessment",
    "Band",
    "Evidence",
    "HardFail",
    "Part",
    "PassMark",
    "Population",
    "Rubric",
    "Standing",
    "Verdict",
    "assess",
    "load_population",
    "load_rubric",
    "pass_mark",
    "shipped_rubrics",
]
