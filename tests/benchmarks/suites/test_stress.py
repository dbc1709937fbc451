"""Suite `stress` counts what pytest tells of a file."""

from pathlib import Path

import pytest

from benchmarks.plan import UnavailableError
from benchmarks.suites.stress import FOLDER, StressPlan, counted


def test_cases_are_counted_by_how_they_ended() -> None:
    told = """<testsuites><testsuite>
        <testcase name="a"/><testcase name="b"/>
        <testcase name="c"><failure message="no"/></testcase>
        <testcase name="d"><error/></testcase>
        <testcase name="e"><skipped/></testcase>
    </testsuite></testsuites>"""
    assert counted(told) == {"passed": 2.0, "failed": 2.0, "left out": 1.0}


def test_every_file_of_the_catalogue_is_a_row() -> None:
    modes = {task.mode for task in StressPlan(quick=True).tasks()}
    files = [f.stem.removeprefix("test_") for f in FOLDER.glob("test_*.py")]
    assert {mode.replace(" ", "_") for mode in modes} == set(files)


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StressPlan:
    (tmp_path / "test_own.py").write_text(
        "import pytest\n"
        "def test_a(): pass\n"
        "def test_b(): assert False\n"
        "@pytest.mark.slow\ndef test_c(): pass\n"
    )
    (tmp_path / "test_patient.py").write_text(
        "import pytest\npytestmark = pytest.mark.slow\ndef test_a(): pass\n"
    )
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = slow: slow\n")
    monkeypatch.setattr("benchmarks.suites.stress.FOLDER", tmp_path)
    return StressPlan(quick=True)


def test_a_file_is_run_and_its_failures_told(plan: StressPlan) -> None:
    own, patient = plan.tasks()
    made = own.measure()
    assert made.counters == {"passed": 1.0, "failed": 1.0, "left out": 0.0}
    assert made.timing.min_s > 0
    with pytest.raises(UnavailableError, match="slow"):
        patient.measure()
