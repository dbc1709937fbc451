import os
import re
from pathlib import Path

import msgspec
import numpy as np
import pytest

from renderers.snapshots.data_store import HIDDEN, DataStore
from renderers.snapshots.pruning import Pruner
from renderers.snapshots.request import SnapshotRequest
from renderers.snapshots.spool import JobState, JobStatus, Spool
from tests.renderers.snapshots.bare_requests import bare_request

DAY_S = 86_400.0


@pytest.fixture
def spool(tmp_path: Path) -> Spool:
    return Spool(tmp_path / "spool")


def ask(spool: Spool, number: int) -> SnapshotRequest:
    """Publish a request for an array of its own."""
    request = bare_request(number, spool.data.put(np.full(3, number)))
    spool.publish(request)
    return request


def end(spool: Spool, state: JobState) -> None:
    claim = spool.claim()
    assert claim is not None
    spool.set_status(claim.job_id, JobStatus(state, 1))


def age(spool: Spool, seconds: float) -> None:
    """Let everything in a spool have happened so long ago."""
    for path in spool.folder.rglob("*"):
        then = path.stat().st_mtime_ns - round(seconds * 1e9)
        os.utime(path, ns=(then, then))


def stored(spool: Spool) -> int:
    return len(list((spool.folder / "data").iterdir()))


def test_a_finished_job_goes_with_its_data_when_its_time_has_come(spool: Spool) -> None:
    request = ask(spool, 1)
    end(spool, JobState.DONE)
    age(spool, 6 * DAY_S)
    pruner = Pruner(spool, keep_s=7 * DAY_S)
    pruner.prune()
    assert spool.status(request.id).state is JobState.DONE
    assert stored(spool) == 1
    age(spool, DAY_S)
    pruner.prune()
    assert spool.status(request.id).state is JobState.QUEUED
    assert not list(spool.jobs.iterdir())
    assert stored(spool) == 0


def test_what_is_waited_for_stays_however_old(spool: Spool) -> None:
    running = ask(spool, 1)
    assert spool.claim() is not None
    ask(spool, 2)
    age(spool, 100 * DAY_S)
    Pruner(spool, 0.0, 0.0).prune()
    assert stored(spool) == 2
    assert spool.status(running.id).state is JobState.RUNNING
    claim = spool.claim()
    assert claim is not None
    assert claim.job_id == f"{2:032x}"


def test_two_jobs_share_an_array_until_both_have_gone(spool: Spool) -> None:
    first = ask(spool, 1)
    end(spool, JobState.FAILED)
    second = msgspec.structs.replace(first, id=f"{2:032x}")
    spool.publish(second)
    age(spool, DAY_S)
    Pruner(spool, 0.0, 0.0).prune()
    assert not spool.job_folder(first.id).exists()
    assert stored(spool) == 1
    end(spool, JobState.CANCELLED)
    age(spool, DAY_S)
    Pruner(spool, 0.0, 0.0).prune()
    assert stored(spool) == 0


def test_an_array_stored_for_a_request_to_come_is_left_alone(spool: Spool) -> None:
    array = np.arange(5)
    digest = spool.data.put(array)
    age(spool, DAY_S)
    # The client wants it again, and is about to say what for.
    spool.data.put(array)
    Pruner(spool, 0.0).prune()
    assert spool.data.get(digest, ("int64",), 1000).tolist() == array.tolist()
    age(spool, DAY_S)
    Pruner(spool, 0.0).prune()
    assert stored(spool) == 0


@pytest.mark.parametrize("before", [True, False])
def test_an_array_wanted_while_it_is_pruned_is_there_afterwards(
    spool: Spool, monkeypatch: pytest.MonkeyPatch, before: bool
) -> None:
    """The client stores it just before, or just after, it is set aside."""
    array = np.arange(5)
    digest = spool.data.put(array)
    age(spool, DAY_S)
    rename = Path.rename

    def interrupted(path: Path, target: Path) -> Path:
        monkeypatch.setattr(Path, "rename", rename)
        if before:
            DataStore(spool.folder / "data").put(array)
        found = rename(path, target)
        if not before:
            DataStore(spool.folder / "data").put(array)
        return found

    monkeypatch.setattr(Path, "rename", interrupted)
    Pruner(spool, 0.0).prune()
    assert Path.rename is rename
    assert spool.data.get(digest, ("int64",), 1000).tolist() == array.tolist()
    assert stored(spool) == 1


def test_what_was_left_half_done_goes(spool: Spool) -> None:
    hidden = spool.jobs / f"{HIDDEN}{1:032x}"
    (hidden / "attempt-1").mkdir(parents=True)
    for folder in (spool.queue, spool.folder / "data"):
        (folder / f"{HIDDEN}abc").write_bytes(b"half")
    spool.ask_cancel(f"{2:032x}")
    Pruner(spool, 0.0).prune()
    assert not hidden.exists()
    assert spool.is_cancelled(f"{2:032x}"), "it may be asked for in a moment"
    age(spool, DAY_S)
    Pruner(spool, 0.0).prune()
    left = [path for path in spool.folder.rglob("*") if path.is_file()]
    assert not left
    assert not list(spool.jobs.iterdir())


def test_a_damaged_status_is_not_taken_for_an_end(spool: Spool) -> None:
    request = ask(spool, 1)
    claim = spool.claim()
    assert claim is not None
    (spool.attempt_folder(request.id) / "status.json").write_bytes(b"odd")
    age(spool, DAY_S)
    Pruner(spool, 0.0).prune()
    assert spool.job_folder(request.id).exists()


def test_no_time_is_negative(spool: Spool) -> None:
    said = re.escape("not negative: (-1.0, 0.0)")
    with pytest.raises(ValueError, match=said):
        Pruner(spool, -1.0, 0.0)


def test_what_is_not_ours_stays(spool: Spool) -> None:
    """A desktop's files, and what somebody keeps there."""
    strangers = [
        spool.folder / part / name
        for part in ("jobs", "data", "queue")
        for name in (".DS_Store", "notes.txt")
    ]
    for file in strangers:
        file.write_text("mine")
    (spool.jobs / "mine").mkdir()
    age(spool, 100 * DAY_S)
    Pruner(spool, keep_s=DAY_S).prune()
    assert all(file.exists() for file in [*strangers, spool.jobs / "mine"])
