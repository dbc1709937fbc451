"""A person before the window, in a process of its own."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from scenarios.scenario import CURRICULUM, bundled_scenarios
from tests.flights import virtual_screen

ROOT = Path(__file__).parents[3]
EVERY = tuple(sorted(bundled_scenarios()))
LADDER = tuple(sorted(file.stem for file in CURRICULUM.glob("*.toml")))
QUICK = ("steady-hold", "path-following", "horizon")
"""What the person does in the fast run."""

MADE, IMPORTED = "case:made", "case:imported"
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
