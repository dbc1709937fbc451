"""What every suite promises of its list of tasks, before anything is computed."""

from contextlib import closing
from pathlib import Path

import pytest

from benchmarks import suites
from benchmarks.plan import SUITES


@pytest.mark.parametrize("quick", [True, False], ids=["quick", "whole"])
@pytest.mark.parametrize("suite", sorted(SUITES))
def test_baselines_come_first_and_names_are_unique(suite: str, quick: bool) -> None:
    with closing(SUITES[suite](quick)) as plan:
        tasks = plan.tasks()
    seen: set[tuple[str, str]] = set()
    for task in tasks:
        assert task.suite == suite
        assert task.baseline is None or (task.case, task.baseline) in seen
        seen.add((task.case, task.mode))
    assert len(seen) == len({task.key for task in tasks}) == len(tasks) > 0


def test_every_module_with_a_suite_registers_it() -> None:
    files = Path(suites.__file__).parent.glob("*.py")
    written = {p.stem for p in files if ', suite="' in p.read_text("utf-8")}
    registered = {suite.__module__.rpartition(".")[2] for suite in SUITES.values()}
    assert registered == written
