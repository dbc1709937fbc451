"""Whatever somebody does to the window, it answers, complains of nothing, and keeps.

MONKEY_SEED repeats a run's choices, as far as the program is as fast as it was.
"""

import json
import os
import random
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from scenarios.bundle import SampleRecord, read_recording
from tests.flights import virtual_screen

ROOT = Path(__file__).parents[2]
LAST = 50
"""Events that are shown of a run that failed."""

LOADING_S = 240.0
"""To start and to end, at most."""


def let_loose(seconds: float, folder: Path) -> tuple[dict[str, Any], str]:
    """Let the monkey do what it wants; what came of it, and what to show if it fails.

    Nothing of the user's is in reach: the program's home is a folder of its own.
    """
    given = os.environ.get("MONKEY_SEED")
    seed = int(given) if given else random.SystemRandom().randrange(1 << 31)
    if os.environ.get("CI") and not given:
        seed = 39
    log = folder / "monkey.log"
    places = {
        "HOME": folder / "home",
        "XDG_DATA_HOME": folder / "data",
        "XDG_CONFIG_HOME": folder / "config",
        "PYTHONPATH": ROOT,
    }
    for place in places.values():
        place.mkdir(exist_ok=True)
    with virtual_screen(1920, 1080):
        done = subprocess.run(
            [sys.executable, "-m", "tests.stress.monkey", str(seed), str(seconds), log],
            # views that it saves lie here
            cwd=folder,
            env=os.environ | {name: str(place) for name, place in places.items()},
            capture_output=True,
            text=True,
            timeout=seconds + LOADING_S,
        )
    last = "\n".join(log.read_text().splitlines()[-LAST:]) if log.exists() else ""
    shown = f"MONKEY_SEED={seed}\n{last}\n{done.stderr}\n{done.stdout[:4000]}"
    assert (done.returncode, done.stderr) == (0, ""), shown
    return json.loads(done.stdout.splitlines()[-1]), shown


def watched(seconds: float, folder: Path) -> dict[str, Any]:
    """Let it loose and look at what it left."""
    told, shown = let_loose(seconds, folder)
    assert told["was_ended"], f"the window closed\n{shown}"
    stalls = [stall for stall in told["stalls"] if stall["own_s"] > 0.5]
    assert not stalls, f"{json.dumps(stalls, indent=1)}\n{shown}"
    for bundle in (folder / "data" / "paravol" / "sessions").glob("*.paravol"):
        recording = read_recording(bundle)
        assert not recording.damages, f"{bundle}\n{shown}"
        flown = [r for r in recording.records if isinstance(r, SampleRecord)]
        is_whole = recording.complete and (bundle / "result.json").is_file()
        assert is_whole or not flown, f"{bundle}\n{shown}"
    return told


@pytest.mark.display
@pytest.mark.timeout(320)
def test_twenty_seconds_of_anything(tmp_path: Path) -> None:
    assert watched(20.0, tmp_path)["events"] > 50


@pytest.mark.slow
@pytest.mark.display
@pytest.mark.timeout(1000)
def test_ten_minutes_of_anything(tmp_path: Path) -> None:
    told = watched(600.0, tmp_path)
    assert told["events"] > 2000
    assert {"HomePage", "FlightPage"} <= set(told["pages"])
