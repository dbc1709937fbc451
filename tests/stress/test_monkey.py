"""Whatever somebody does to the window, it answers, complains of nothing, and keeps.

MONKEY_SEED repeats a run's choices, as far as the program is as fast as it was.
"""

import json
import os
import random
import subprocess
import sys
from pathlib import Path

import pytest

from scenarios.bundle import SampleRecord, read_recording
from system import UserError
from tests.flights import virtual_screen

ROOT = Path(__file__).parents[2]
LAST = 50
"""Events that are shown of a run that failed."""

LOADING_S = 240.0
"""To start and to end, at most."""


def let_loose(seconds: float, folder: Path, least: int, pages: set[str]) -> None:
    """Let the monkey do what it wants, and look at what it left.

    All that is wrong is told at once: a run takes long, and none is like another.
    Nothing of the user's is in reach: the program's home is a folder of its own.

    least: how many events it must have come to. pages: which it must have seen.
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
    problems = []
    with (
        virtual_screen(1920, 1080),
        subprocess.Popen(
            [sys.executable, "-m", "tests.stress.monkey", str(seed), str(seconds), log],
            # views that it saves lie here
            cwd=folder,
            env=os.environ | {name: str(place) for name, place in places.items()},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as child,
    ):
        try:
            output, said = child.communicate(timeout=seconds + LOADING_S)
        except subprocess.TimeoutExpired:
            problems.append("it did not end")
            child.kill()
            output, said = child.communicate()
    if (child.returncode, said) != (0, ""):
        problems.append(f"it ended with {child.returncode} and said:\n{said}")
    try:
        told = json.loads(output.splitlines()[-1])
    except (ValueError, IndexError):
        problems.append("it did not tell what came of it")
    else:
        if not told["was_ended"]:
            problems.append("the window closed")
        stalls = [stall for stall in told["stalls"] if stall["own_s"] > 0.5]
        if stalls:
            problems.append(f"it stalled:\n{json.dumps(stalls, indent=1)}")
        if told["events"] < least or not pages <= set(told["pages"]):
            problems.append(f"it came to {told['events']} events on {told['pages']}")
    for bundle in (folder / "data" / "paravol" / "sessions").glob("*.paravol"):
        problems += harm_to(bundle)
    last = "\n".join(log.read_text().splitlines()[-LAST:]) if log.exists() else ""
    shown = f"MONKEY_SEED={seed}\n{last}\n{output[:4000]}"
    assert not problems, "\n\n".join([*problems, shown])


def harm_to(bundle: Path) -> list[str]:
    """Return what is wrong with a recording."""
    try:
        recording = read_recording(bundle)
    except UserError as error:
        return [f"{bundle}: {error}"]
    harm = [f"{bundle}: {damage}" for damage in recording.damages]
    flown = [r for r in recording.records if isinstance(r, SampleRecord)]
    if flown and not (recording.complete and (bundle / "result.json").is_file()):
        harm.append(f"{bundle} has no end")
    return harm


@pytest.mark.display
@pytest.mark.timeout(320)
def test_twenty_seconds_of_anything(tmp_path: Path) -> None:
    let_loose(20.0, tmp_path, 50, set())


@pytest.mark.slow
@pytest.mark.display
@pytest.mark.timeout(1000)
def test_ten_minutes_of_anything(tmp_path: Path) -> None:
    let_loose(600.0, tmp_path, 2000, {"HomePage", "FlightPage"})
