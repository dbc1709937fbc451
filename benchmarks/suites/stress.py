"""The stress catalogue, run as it stands in the tests: how much of it holds.

Each row is one file of ``tests/stress``. Quick runs leave out what is marked slow.
"""

import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

from benchmarks.machine import ROOT
from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.timing import Timing

FOLDER = ROOT / "tests" / "stress"
NOTHING_CHOSEN = 5
"""pytest's exit status where all tests of a file are left out."""

LIMIT_S = 1800.0


class StressPlan(Plan, suite="stress"):
    """List and make the measurements of suite `stress`."""

    def __init__(self, quick: bool) -> None:
        self._quick = quick

    def tasks(self) -> list[Task]:
        """List the files."""
        return [
            self.task(
                "tests/stress",
                file.stem.removeprefix("test_").replace("_", " "),
                partial(self._run, file),
                {"quick": self._quick},
                clock="wall",
                cost_s=15.0 if self._quick else 60.0,
            )
            for file in sorted(FOLDER.glob("test_*.py"))
        ]

    def _run(self, file: Path) -> Measured:
        with tempfile.TemporaryDirectory(prefix="paravol-stress-") as folder:
            told = Path(folder) / "told.xml"
            words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
            words += [f"--junitxml={told}", str(file)]
            if self._quick:
                words += ["-m", "not slow"]
            began = time.perf_counter()
            done = subprocess.run(
                words,
                cwd=ROOT,
                capture_output=True,
                text=True,
                timeout=LIMIT_S,
                check=False,
            )
            seconds = time.perf_counter() - began
            if done.returncode == NOTHING_CHOSEN:
                raise UnavailableError("all of a file is slow; a quick run leaves it")
            if not told.is_file():
                said = (done.stderr or done.stdout).strip().splitlines()[-1:]
                raise UnavailableError(f"the stress tests could not be run: {said}")
            counters = counted(told.read_text("utf-8"))
        return Measured(Timing.of([seconds], [seconds]), counters=counters)


def counted(junit: str) -> dict[str, float]:
    """Return how many cases passed, failed (or could not begin) and were left out."""
    cases = list(ElementTree.fromstring(junit).iter("testcase"))
    told = [{child.tag for child in case} for case in cases]
    failed = sum(bool({"failure", "error"} & tags) for tags in told)
    left = sum("skipped" in tags for tags in told)
    return {
        "passed": float(len(cases) - failed - left),
        "failed": float(failed),
        "left out": float(left),
    }
