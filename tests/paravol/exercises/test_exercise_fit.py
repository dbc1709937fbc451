"""Whether an exercise fits its head."""

import msgspec
import numpy as np
import pytest

from paravol.exercises.exercise_fit import check_fit
from paravol.patient import PatientScene
from scenarios import load_scenario
from scenarios.tasks.task import Survey
from system import UserError
from tests.scenes import make_scene


def test_a_survey_of_a_site_that_the_head_does_not_have_is_told() -> None:
    scenario, _ = load_scenario("first_flight")
    patient = PatientScene(
        make_scene(), dict.fromkeys(scenario.targets, np.zeros(3)), ""
    )
    check_fit(scenario, patient)
    for site in ("middle meatos", "choana, left"):
        survey = Survey(name="look", title="Look", sites={site: 50.0})
        asked = msgspec.structs.replace(scenario, tasks=(survey,))
        with pytest.raises(UserError, match="there are: nasal cavity"):
            check_fit(asked, patient)
