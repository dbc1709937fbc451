"""A result names its machine and its sources."""

import os
import subprocess
from pathlib import Path

import msgspec

from benchmarks.machine import commit, is_same_machine, machine

AUTHOR = ("-c", "user.name=a", "-c", "user.email=a@b.invalid")


def test_the_machine_is_this_one() -> None:
    here = machine()
    assert here.cpu
    assert here.cores == len(os.sched_getaffinity(0))
    assert here.memory_gib > 0
    busy = msgspec.structs.replace(here, load=here.load + 5)
    assert is_same_machine(here, busy)
    assert not is_same_machine(here, msgspec.structs.replace(here, cores=999))


def git(root: Path, *words: str) -> None:
    subprocess.run(["git", "-C", str(root), *AUTHOR, *words], check=True)


def test_the_commit_tells_changed_sources_apart(tmp_path: Path) -> None:
    (tmp_path / "renderers").mkdir()
    source = tmp_path / "renderers" / "a.py"
    source.write_text("A = 1\n")
    names = [commit(tmp_path)]
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", "renderers")
    git(tmp_path, "commit", "-q", "-m", "first")
    commit.cache_clear()
    names.append(commit(tmp_path))
    for text in ("A = 2\n", "A = 3\n"):
        source.write_text(text)
        commit.cache_clear()
        names.append(commit(tmp_path))
    source.write_text("A = 1\n")
    commit.cache_clear()
    assert commit(tmp_path) == names[1]
    assert names[0].startswith("sources-")
    assert all(name.startswith(names[1] + "+") for name in names[2:])
    assert len(set(names)) == 4
    commit.cache_clear()
