"""What mpiexec does with two ranks is found out by starting them."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from paravol.checks import machine_check
from paravol.checks.finding import Finding
from paravol.checks.machine_check import machine_findings, program_findings, two_ranks
from renderers.snapshots.launcher import Launcher


def launcher(tmp_path: Path, script: str) -> Launcher:
    file = tmp_path / "mpiexec"
    file.write_text(f"#!/bin/sh\n{script}\n")
    file.chmod(0o755)
    return Launcher(str(file), False)


@pytest.mark.skipif(sys.platform == "win32", reason="a shell's script")
@pytest.mark.parametrize(
    ("script", "told", "helps"),
    [
        ("printf '22\\n\\n'", "found each other", ""),
        ("echo 1; echo 1", "do not find each other", "different MPIs"),
        ("echo 'no slots' >&2; exit 3", "fail (no slots)", "one rank"),
        ("exit 3", "fail (status 3)", "one rank"),
    ],
)
def test_two_ranks_are_told_apart_from_one_twice(
    tmp_path: Path, script: str, told: str, helps: str
) -> None:
    value, remedy = two_ranks(launcher(tmp_path, script))
    assert told in value
    assert helps in remedy
    assert bool(helps) == bool(remedy)


def test_a_launcher_that_is_none_or_hangs_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    value, remedy = two_ranks(Launcher(str(tmp_path / "none"), False))
    assert "do not start" in value
    assert "--ranks 1" in remedy
    monkeypatch.setattr(machine_check, "_RANKS_PATIENCE_S", 0.1)
    assert "do not start" in two_ranks(launcher(tmp_path, "exec sleep 20"))[0]


def test_packages_of_the_same_names_by_others_are_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def found(makers: dict[str, list[str]]) -> Finding:
        monkeypatch.setattr(machine_check, "packages_distributions", lambda: makers)
        return next(f for f in machine_findings() if f.name == "package names")

    ours = {name: ["paravol-ess"] for name in machine_check.OUR_PACKAGES}
    assert not found(ours | {"numpy": ["numpy"]}).is_missing
    clash = found(ours | {"app": ["paravol-ess", "other-app"]})
    assert clash.is_missing
    assert "app by other-app" in clash.value
    assert "environment of its own" in clash.remedy


def test_a_full_disk_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine_check, "find_launcher", lambda: None)
    monkeypatch.setattr("shutil.disk_usage", lambda place: SimpleNamespace(free=3e8))
    found = {finding.name: finding for finding in program_findings()}
    assert "0.3 GB free" in found["room for recordings"].value
    assert "make room" in found["room for recordings"].remedy
    assert "make room" in found["room for caches"].remedy
