import threading
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from renderers.scene import Camera, Scene
from renderers.snapshots.client import (
    SnapshotCancelledError,
    SnapshotClient,
    SnapshotError,
)
from renderers.snapshots.request import SnapshotRequest
from renderers.snapshots.worker import run_worker


def test_a_finished_id_is_answered_again(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    request = client.request_classic(scene, outside)
    client.submit(request)
    run_worker(client.spool.folder, once=True)
    before = client.wait(request.id).result
    client.submit(request)
    assert run_worker(client.spool.folder, once=True) == 0
    assert client.wait(request.id).result == before


def test_an_array_is_stored_once_and_not_kept_alive(
    client: SnapshotClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    array = np.arange(10.0)
    alive = weakref.ref(array)
    digest = client.put(array)
    monkeypatch.setattr(client.data, "put", None)
    assert client.put(array) == digest
    monkeypatch.undo()
    (client.spool.folder / "data" / digest).unlink()
    assert client.put(array) == digest
    assert (client.spool.folder / "data" / digest).exists(), "pruned, and stored again"
    del array
    assert alive() is None


def test_nobody_serves(client: SnapshotClient, scene: Scene, outside: Camera) -> None:
    job = client.submit(client.request_classic(scene, outside))
    with pytest.raises(SnapshotError, match=r"still queued after 0\.1 s; is a worker"):
        client.wait(job, timeout_s=0.1)


def test_a_job_cancelled_in_the_queue_is_never_drawn(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    job = client.submit(client.request_classic(scene, outside))
    client.cancel(job)
    run_worker(client.spool.folder, once=True)
    with pytest.raises(SnapshotCancelledError):
        client.wait(job)
    assert not (client.spool.job_folder(job) / "result.json").exists()


def test_the_example_of_the_documents(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = Path(__file__).parents[3] / "docs" / "snapshot_client.md"
    example = page.read_text().partition("```python\n")[2].partition("```")[0]
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    asked = threading.Event()
    submit = SnapshotClient.submit

    def told(self: SnapshotClient, request: SnapshotRequest) -> str:
        job = submit(self, request)
        asked.set()
        return job

    def serve() -> None:
        asked.wait(60)
        run_worker(tmp_path / "spool", once=True)

    monkeypatch.setattr(SnapshotClient, "submit", told)
    worker = threading.Thread(target=serve)
    worker.start()
    exec(compile(example, page, "exec"), names)
    worker.join()
    said = capsys.readouterr().out.splitlines()
    assert said[-1].startswith("True ")
    assert said[-2].endswith("picture.png")
    assert names["rgb"].shape == (64, 64, 3)
    assert names["rgb"][32, 32].min() > 0
    # from the eye to the nearest point of the ball
    assert names["depth_mm"][32, 32] == pytest.approx(45.5, abs=1.0)
    assert np.isinf(names["depth_mm"][0, 0])
