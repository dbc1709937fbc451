"""Rubrics: how the metrics of a session become points, as data; docs/scoring.md."""

from scenarios.rubrics.assess import Evidence, assess
from scenarios.rubrics.assessment import (
    Assessment,
    Band,
    ExerciseMark,
    HardFail,
    RubricPart,
    Standing,
    Verdict,
)
from scenarios.rubrics.contrasting_groups import PassMark, pass_mark
from scenarios.rubrics.exercise_mark import exercise_mark
from scenarios.rubrics.population import (
    Population,
    bundled_populations,
    population_of,
)
from scenarios.rubrics.rubric import Rubric, load_rubric, shipped_rubrics

__all__ = [
    "Assessment",
    "Band",
    "Evidence",
    "ExerciseMark",
    "HardFail",
    "PassMark",
    "Population",
    "Rubric",
    "RubricPart",
    "Standing",
    "Verdict",
    "assess",
    "bundled_populations",
    "exercise_mark",
    "load_rubric",
    "pass_mark",
    "population_of",
    "shipped_rubrics",
]
