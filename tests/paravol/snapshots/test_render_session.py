"""Requests to workers that others run: waited for, told, taken back."""

import threading
from pathlib import Path

import pytest

from paravol.snapshots import render_session
from paravol.snapshots.render_session import ServedSpool
from renderers.snapshots.client import SnapshotCancelledError, SnapshotClient
from renderers.snapshots.spool import JobState, JobStatus
from renderers.snapshots.worker import run_worker
from tests.paravol.snapshots.darkroom import ask


@pytest.fixture
def client(tmp_path: Path) -> SnapshotClient:
    return SnapshotClient(tmp_path / "spool")


@pytest.fixture
def job(client: SnapshotClient) -> str:
    return ask(client)


def test_it_tells_that_nobody_serves_and_takes_what_comes(
    client: SnapshotClient, job: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(render_session, "SAY_AFTER_S", 0.1)
    said: list[str] = []
    told = threading.Event()

    def say(sentence: str) -> None:
        said.append(sentence)
        told.set()

    def serve() -> None:
        told.wait(60)
        run_worker(client.spool.folder, once=True)

    worker = threading.Thread(target=serve)
    worker.start()
    shares: list[float] = []
    snapshot = ServedSpool(client, say).wait(job, shares.append, None)
    worker.join()
    assert snapshot.pixels().max() > 100
    assert len(said) == 1
    assert f"paravol worker --spool {client.spool.folder}" in said[0]


def test_what_nobody_began_is_taken_back(client: SnapshotClient, job: str) -> None:
    served = ServedSpool(client, lambda sentence: None)
    assert served.take_back(job)
    run_worker(client.spool.folder, once=True)
    with pytest.raises(SnapshotCancelledError):
        served.wait(job, lambda share: None, None)


def test_another_worker_is_waited_for(client: SnapshotClient, job: str) -> None:
    """The one that took the job died; that is told once, and no reason to give up."""
    client = SnapshotClient(client.spool.folder, lease_s=0.3)
    assert client.spool.claim() is not None
    said: list[str] = []

    def say(sentence: str) -> None:
        said.append(sentence)
        client.spool.begin_attempt(job, 2)
        client.spool.set_status(job, JobStatus(JobState.CANCELLED, 2))

    served = ServedSpool(client, say)
    assert not served.take_back(job)
    with pytest.raises(SnapshotCancelledError):
        served.wait(job, lambda share: None, None)
    assert len(said) == 1
    assert "no sign of life" in said[0]
