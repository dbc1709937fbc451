"""Every exercise of the ladder can be done, by a hand without a screen."""

import re
from pathlib import Path

import msgspec
import pytest

from paravol.exercises.exercise_fit import check_fit
from paravol.exercises.scripted_hand import ScriptedHand, undone
from paravol.patient import load_patient, no_progress
from scenarios import Scenario, load_scenario
from scenarios.scenario import CURRICULUM, bundled_scenarios
from scenarios.tasks import Task

NAMES = sorted(file.stem for file in CURRICULUM.glob("*.toml"))
FAST = ("hoops",)
PAGE = Path(__file__).parents[2] / "docs" / "scenarios.md"


def test_the_ladder_has_steps_of_every_level() -> None:
    exercises = {name: load_scenario(name)[0] for name in NAMES}
    assert len(exercises) >= 12
    assert {e.level for e in exercises.values()} == {
        "novice",
        "intermediate",
        "advanced",
    }
    for name, exercise in exercises.items():
        assert exercise.name == name
        assert exercise.tasks
        assert set(exercise.needs) <= set(NAMES)
    # each can be come to: what it needs, needs nothing that needs it
    opened: set[str] = set()
    while left := {n for n in NAMES if n not in opened}:
        more = {n for n in left if opened.issuperset(exercises[n].needs)}
        assert more, f"these wait for one another: {left}"
        opened |= more


@pytest.mark.parametrize(
    ("name", "attempt"),
    [
        (n, k) if n in FAST else pytest.param(n, k, marks=pytest.mark.slow)
        for n in NAMES
        for k in range(1, 1 + (len(load_scenario(n)[0].head.patients) or 1))
    ],
)
@pytest.mark.timeout(900)
def test_an_exercise_can_be_done(name: str, attempt: int) -> None:
    scenario, _ = load_scenario(name)
    head = scenario.head.of_attempt(attempt)
    scenario = msgspec.structs.replace(scenario, head=head)
    patient = load_patient(scenario, no_progress)
    check_fit(scenario, patient)
    hand = ScriptedHand(scenario, patient, operates=bool(scenario.tools))
    hand.do_all()
    assert undone(hand) == []
    # what it tried and took back is in none of its samples
    again = ScriptedHand(scenario, patient, operates=bool(scenario.tools))
    for sample in hand.samples:
        again.session.step(sample)
    assert undone(again) == []
    assert again.tissue == hand.tissue


def test_the_page_describes_every_key() -> None:
    words = set(re.findall(r"`([^`\n]+)`", PAGE.read_text()))
    kinds = msgspec.inspect.type_info(Scenario)
    assert isinstance(kinds, msgspec.inspect.StructType)
    keys = {field.encode_name for field in kinds.fields}
    for part in (
        *Task.__args__,
        *(
            f.type.cls
            for f in kinds.fields
            if isinstance(f.type, msgspec.inspect.StructType)
        ),
    ):
        keys |= {field.encode_name for field in msgspec.structs.fields(part)}
        config = part.__struct_config__
        if config.tag is not None:
            assert config.tag in words
    assert not keys - words
    assert set(bundled_scenarios()) >= set(NAMES)
