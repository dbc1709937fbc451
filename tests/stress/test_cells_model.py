"""The rules of docs/ranks.md in another formalism, checked by Spin where it is there.

Debian: `apt-get install spin`, and a C compiler. Nothing else depends on it.
"""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.slow_cases import slow

MODEL = Path(__file__).with_name("cells.pml")
LIMIT_S = 200.0

pytestmark = pytest.mark.skipif(
    shutil.which("spin") is None or shutil.which("cc") is None,
    reason="there is no Spin, or no C compiler",
)

SYSTEMS = [(1, 968), (2, 1_550), *slow((3, 32_659), (4, 12_761))]


def check(folder: Path, *defines: str, cycles: bool = False) -> tuple[int, int, str]:
    """Explore a system; return errors, states, and what Spin said.

    cycles: look for schedules that go on for ever instead of for broken assertions.
    """
    words = [f"-D{define}" for define in defines]
    subprocess.run(
        ["spin", *words, "-a", str(MODEL)],
        cwd=folder,
        check=True,
        capture_output=True,
        timeout=LIMIT_S,
    )
    kind = "-DNP" if cycles else "-DSAFETY"
    # COLLAPSE and VECTORSZ are about memory only. Optimising takes two seconds and
    # saves none: the largest system is explored in a quarter of one.
    options = ["-O0", kind, "-DCOLLAPSE", "-DVECTORSZ=4096"]
    subprocess.run(
        ["cc", *options, "-o", "pan", "pan.c"],
        cwd=folder,
        check=True,
        capture_output=True,
        timeout=LIMIT_S,
    )
    run = ["./pan", "-m400000", *(["-l"] if cycles else [])]
    said = subprocess.run(
        run, cwd=folder, check=True, capture_output=True, text=True, timeout=LIMIT_S
    ).stdout
    errors = re.search(r"errors: (\d+)", said)
    states = re.search(r"(\d+) states, stored", said)
    assert errors
    assert states
    assert "max search depth too small" not in said
    return int(errors[1]), int(states[1]), said


@pytest.mark.parametrize(("system", "states"), SYSTEMS)
def test_every_schedule_keeps_the_invariants(
    tmp_path: Path, system: int, states: int
) -> None:
    errors, found, said = check(tmp_path, f"SYSTEM={system}")
    assert errors == 0, said
    assert found == states, "the figure of docs/ranks.md"


@pytest.mark.parametrize(("system", "states"), SYSTEMS)
def test_no_schedule_goes_on_for_ever(tmp_path: Path, system: int, states: int) -> None:
    errors, _, said = check(tmp_path, f"SYSTEM={system}", cycles=True)
    assert errors == 0, said


def test_owners_do_change(tmp_path: Path) -> None:
    errors, _, said = check(tmp_path, "SYSTEM=2", "STILL")
    assert errors == 1
    assert "moved==0" in said


@pytest.mark.parametrize(
    ("rule", "system"),
    [
        ("NO_DEFERRAL", 1),
        *slow(("NO_ORDER", 1), ("NO_ANSWER", 2), ("NO_ROOM", 1), ("LEAVING", 1)),
    ],
)
def test_without_any_of_the_rules_something_breaks(
    tmp_path: Path, rule: str, system: int
) -> None:
    errors, _, said = check(tmp_path, f"SYSTEM={system}", rule)
    assert errors == 1
    assert "assertion violated" in said
