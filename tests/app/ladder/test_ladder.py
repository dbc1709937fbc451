"""Every exercise is begun by clicks in the real window and done by a person.

The person sees what is on the screen and has mouse, wheel and keys; see `person`. On a
machine without a screen, or without OpenGL, all this is skipped.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from app.__main__ import main
from scenarios.scenario import CURRICULUM, bundled_scenarios
from tests.flights import virtual_screen

pytestmark = pytest.mark.display

ROOT = Path(__file__).parents[3]
EVERY = tuple(sorted(bundled_scenarios()))
LADDER = tuple(sorted(file.stem for file in CURRICULUM.glob("*.toml")))
MADE, IMPORTED = "case:made", "case:imported"
QUICK = ("steady-hold", "centring", "horizon")
TRIES = 3
KEPT = "LADDER_FOLDER"
"""Of the environment: where the person's pictures and words are kept."""

Verdict = dict[str, Any]


def sat(folder: Path, *words: object, limit_s: float) -> dict[str, Verdict]:
    """Let a person sit before the window; return verdicts by the exercise."""
    folder = Path(os.environ.get(KEPT, folder))
    command = [sys.executable, "-m", "tests.app.ladder.ladder_run"]
    command += [*map(str, words), "--folder", str(folder), "--aloud"]
    with virtual_screen(1600, 1000):
        done = subprocess.run(
            command,
            cwd=ROOT,
            env=os.environ | {"QT_QPA_PLATFORM": "xcb"},
            capture_output=True,
            text=True,
            timeout=limit_s,
        )
    told = [json.loads(line) for line in done.stdout.splitlines()]
    for verdict in told:
        print(json.dumps(verdict))
    assert done.returncode == 0, done.stderr[-6000:]
    return {verdict["exercise"]: verdict for verdict in told}


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """A made head as a case, and its CT imported as a scan of nobody known."""
    folder = tmp_path_factory.mktemp("cases")
    made, imported = folder / "made", folder / "imported"
    coarse = ["--spacing", "1.0"]
    assert main(["phantom", "--out", str(made), *coarse]) == 0
    scan = ["import", str(made / "ct.nrrd"), "--out", str(imported), *coarse]
    assert main(scan) == 0
    return [made, imported]


@pytest.fixture(scope="module")
def starts(
    tmp_path_factory: pytest.TempPathFactory, cases: list[Path]
) -> dict[str, Verdict]:
    """Begin all there is, one after the other, in one window; heads are coarse."""
    words = [*EVERY, MADE, IMPORTED, "--only-start", "--coarse"]
    for case in cases:
        words += ["--case", str(case)]
    return sat(tmp_path_factory.mktemp("starts"), *words, limit_s=1500.0)


@pytest.mark.timeout(1600)
@pytest.mark.parametrize("exercise", [*EVERY, MADE, IMPORTED])
def test_it_begins_by_clicks_from_the_home_page(
    starts: dict[str, Verdict], exercise: str
) -> None:
    verdict = starts[exercise.removeprefix("case:")]
    assert verdict["began"], verdict
    assert verdict["why"] == ""


@pytest.mark.timeout(1700)
def test_a_person_does_three_exercises(tmp_path: Path) -> None:
    told = sat(tmp_path, *QUICK, "--tries", TRIES, "--limit", 400, limit_s=1600.0)
    for exercise in QUICK:
        assert told[exercise]["done"], told[exercise]
        assert told[exercise]["passed"], told[exercise]


@pytest.mark.slow
@pytest.mark.timeout(4000)
@pytest.mark.parametrize("exercise", LADDER)
def test_a_person_does_each_exercise(exercise: str, tmp_path: Path) -> None:
    told = sat(tmp_path, exercise, "--tries", TRIES, "--limit", 900, limit_s=3900.0)
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
