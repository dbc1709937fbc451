"""The snapshot worker as a child: killed, refused, ended."""

import os
import signal
import time
from itertools import repeat
from pathlib import Path

import pytest

from app.__main__ import main
from paravol.snapshots import rendering_service
from paravol.snapshots.rendering_service import (
    running_worker,
    startable_ranks,
    worker_command,
)
from paravol.snapshots.worker_options import WorkerOptions
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.launcher import Launcher
from system import UserError
from tests.paravol.snapshots.darkroom import ask


def processes_of(group: int) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[2]) == group and fields[0] != "Z":
                found.append(int(entry.name))
    return found


def test_a_worker_draws_and_leaves_nothing_behind(tmp_path: Path) -> None:
    client = SnapshotClient(tmp_path / "spool dir")
    job = ask(client)
    with running_worker(tmp_path / "spool dir", ranks=1) as worker:
        group = worker.pid
        snapshot = client.wait(job, timeout_s=200, watch=worker.ensure_alive)
        assert snapshot.pixels().max() > 100
    assert processes_of(group) == []


def test_a_killed_worker_is_one_sentence(tmp_path: Path) -> None:
    client = SnapshotClient(tmp_path)
    job = ask(client)
    with running_worker(tmp_path, ranks=1) as worker:
        os.kill(worker.pid, signal.SIGKILL)
        with pytest.raises(UserError, match="worker ended"):
            client.wait(job, timeout_s=60, watch=worker.ensure_alive)
    # the request is still there for the next worker
    with running_worker(tmp_path, ranks=1) as worker:
        snapshot = client.wait(job, timeout_s=200, watch=worker.ensure_alive)
        assert snapshot.result.width == 16


@pytest.mark.mpi
def test_ranks_end_with_their_worker(tmp_path: Path) -> None:
    client = SnapshotClient(tmp_path)
    job = ask(client)
    with running_worker(tmp_path, ranks=2) as worker:
        group = worker.pid
        snapshot = client.wait(job, timeout_s=200, watch=worker.ensure_alive)
        assert snapshot.result.ranks == 2
    deadline = time.monotonic() + 10
    while processes_of(group) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert processes_of(group) == []


def test_a_spool_that_cannot_be_used(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("not a folder")
    assert main(["worker", "--spool", str(tmp_path / "file"), "--once"]) == 1
    lines = capfd.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert "file" in lines[0]


def test_a_launcher_that_is_not_there_is_one_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("PARAVOL_MPIEXEC", "/nowhere/mpiexec")
    assert main(["worker", "--spool", str(tmp_path), "--ranks", "2"]) == 1
    said = capsys.readouterr().err
    assert "PARAVOL_MPIEXEC names /nowhere/mpiexec, which is no program" in said


def test_ranks_are_as_asked_where_they_can_be_started(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = Launcher("mpiexec", is_open_mpi=True), None
    for launcher in found:
        monkeypatch.setattr(
            rendering_service, "find_launcher", repeat(launcher).__next__
        )
        assert startable_ranks(None) == startable_ranks(1) == 1
        assert launcher is None or startable_ranks(3) == 3
    with pytest.raises(UserError, match="with 3 ranks needs MPI"):
        startable_ranks(3)


def test_no_ranks_is_a_mistake(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="at least 1"):
        worker_command(tmp_path, WorkerOptions(ranks=0))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (["--threads", "0"], "--threads must be at least 1, got 0"),
        (["--lease", "0"], "--lease must be a positive time, got 0"),
        (["--lease", "nan"], "--lease must be a positive time, got nan"),
        (["--keep-days", "-1"], "--keep-days must not be negative, got -1"),
        (["--ranks", "2", "--cache-cells", "0"], "--cache-cells must be at least 1"),
        (["--ranks", "2", "--memory-gb", "0"], "--memory-gb must be above 0"),
        (
            ["--ranks", "2", "--dataflow", "shared", "--cache-cells", "9"],
            "share memory keep all cells",
        ),
        (["--memory-gb", "2"], "take more --ranks than 1"),
        (["--dataflow", "static"], "take more --ranks than 1"),
        (["--from-file"], "take more --ranks than 1"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wrong: list[str], said: str
) -> None:
    assert main(["worker", "--spool", str(tmp_path), *wrong]) == 1
    assert said in capsys.readouterr().err


def test_a_worker_in_the_foreground_prunes_what_it_drew(tmp_path: Path) -> None:
    spool = tmp_path / "spool"
    client = SnapshotClient(spool)
    job = ask(client)
    words = ["worker", "--spool", str(spool), "--once", "--threads", "1"]
    assert main([*words, "--lease", "5", "--keep-days", "1"]) == 0
    assert client.wait(job, timeout_s=1).pixels().max() > 100
    assert main([*words, "--keep-days", "0"]) == 0
    assert not list((spool / "jobs").iterdir())


@pytest.mark.mpi
@pytest.mark.slow
def test_a_worker_of_ranks_shares_cells_as_it_is_told(tmp_path: Path) -> None:
    pytest.importorskip("mpi4py")
    spool = tmp_path / "spool"
    client = SnapshotClient(spool)
    job = ask(client)
    words = ["worker", "--spool", str(spool), "--once", "--ranks", "2"]
    words += ["--oversubscribe"]
    assert main([*words, "--from-file", "--cache-cells", "1"]) == 0
    result = client.wait(job, timeout_s=1).result
    assert result.ranks == 2
    assert result.counters["cells_evicted"] > 0
