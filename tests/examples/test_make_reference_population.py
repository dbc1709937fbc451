"""The bundled populations can be compared with what a trainee flies."""

import runpy
from pathlib import Path

import pytest

from scenarios.rubrics.population import bundled_populations, load_population

EXAMPLE = Path(__file__).parents[2] / "examples" / "make_reference_population.py"


@pytest.mark.parametrize("exercise", bundled_populations())
def test_it_was_measured_by_the_rubric_of_its_exercise(exercise: str) -> None:
    population = load_population(bundled_populations()[exercise])
    settings = runpy.run_path(str(EXAMPLE))["usual_settings"](exercise)
    assert population.mismatch(exercise, settings) == ""
