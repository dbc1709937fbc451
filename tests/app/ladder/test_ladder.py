"""Every exercise is done in the real window by a person.

The person sees what is on the screen and has mouse, wheel and keys; see `person`. On a
machine without a screen, or without OpenGL, all this is skipped.
"""

from pathlib import Path

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from tests.app.ladder.sitting_process import EVERY, IMPORTED, LADDER, MADE, QUICK, sat

pytestmark = pytest.mark.display

TRIES = 3


@pytest.mark.timeout(1700)
def test_a_person_does_three_exercises(tmp_path: Path) -> None:
    told = sat(tmp_path, *QUICK, "--tries", TRIES, "--limit", 400, limit_s=1600.0)
    for exercise in QUICK:
        assert told[exercise]["done"], told[exercise]
        assert told[exercise]["passed"], told[exercise]


@pytest.mark.slow
@pytest.mark.timeout(5400)
@pytest.mark.parametrize("exercise", LADDER)
def test_a_person_does_each_exercise(exercise: str, tmp_path: Path) -> None:
    told = sat(tmp_path, exercise, "--tries", TRIES, "--limit", 1500, limit_s=5300.0)
    assert told[exercise]["done"], told[exercise]
    assert told[exercise]["passed"], told[exercise]


@pytest.mark.slow
@pytest.mark.timeout(1600)
def test_a_person_flies_through_cases_and_recorded_flights(
    tmp_path: Path, cases: list[Path]
) -> None:
    free = [name for name in EVERY if name not in LADDER]
    words: list[object] = [*free, MADE, IMPORTED]
    for case in cases:
        words += ["--case", case]
    told = sat(tmp_path, *words, limit_s=1500.0)
    for name, verdict in told.items():
        assert verdict["done"], (name, verdict)


@pytest.mark.slow
@pytest.mark.timeout(2000)
def test_a_person_brings_each_tool_to_named_places(tmp_path: Path) -> None:
    """In ten seconds each, and hurts nobody."""
    told = sat(tmp_path, "uncinectomy", "--places-tools", limit_s=1900.0)["uncinectomy"]
    assert told["placings"]
    assert all(each["seconds"] is not None for each in told["placings"]), told
    assert not any("injury:" in line for line in told["injuries"]), told
