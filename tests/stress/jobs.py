"""A small job, a process that kills those who do it, and what must hold afterwards."""

import hashlib
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import numpy as np
from PIL import Image as PngImage

from renderers.art import ActiveRayTracer
from renderers.scene import Camera, Projection, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.data_store import HIDDEN
from renderers.snapshots.growing import FILE_NAME, GrowingPicture
from renderers.snapshots.request import ClassicWork, SnapshotRequest, SnapshotResult
from renderers.snapshots.saved_work import ENDING, unwrap
from renderers.snapshots.spool import JobState, JobStatus, Spool
from renderers.snapshots.team import traced_camera
from renderers.snapshots.worker import run_worker
from tests.scenes import rough_scene
from tests.stress.doomed import Order, Outcome

LEASE_S = 0.05

SIZE = (150, 130)
"""Several packets of rays, and a coarse picture before."""


def small_scene() -> Scene:
    """Make noise seen through thin and thick extinction."""
    return rough_scene((20, 24, 28), (-7, -6, -8))


class Job:
    """A request, and what its picture's radiance must be, by hash."""

    def __init__(self, folder: Path, size: tuple[int, int] = SIZE) -> None:
        """Ask in a spool of its own, so that no other holds the array."""
        scene = small_scene()
        camera = Camera.looking_at(
            [22, -15, 8],
            [0, 0, 0],
            extent=0.5,
            size=size,
            projection=Projection.PERSPECTIVE,
        )
        client = SnapshotClient(folder / "made")
        self.array = folder / "array.npy"
        np.save(self.array, scene.volume.values)
        self.request = client.request_classic(
            scene, camera, quality="preview", progressive=True
        )
        drawn = ActiveRayTracer(scene, "preview", threads=1).render(camera)
        self.digest = hashlib.sha256(drawn.rgba.tobytes()).hexdigest()

    def order(self, spool: Path, role: str, step: str = "", nth: int = 1) -> Order:
        """Tell a child what to do with this job."""
        text = msgspec.json.encode(self.request).decode()
        return Order(str(spool), role, text, str(self.array), step, nth)


class Children:
    """Talk to a process of `doomed`."""

    def __init__(self, child: "subprocess.Popen[str]") -> None:
        self._child = child

    def run(self, order: Order) -> Outcome:
        """Let a child act, and wait until it has ended or stopped."""
        return self._say(msgspec.json.encode(order).decode())

    def awaken(self, pid: int) -> Outcome:
        """Let a stopped child go on, and wait until it has ended."""
        return self._say(str(pid))

    def _say(self, line: str) -> Outcome:
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        self._child.stdin.write(line + "\n")
        self._child.stdin.flush()
        answer = self._child.stdout.readline()
        assert answer, f"no child can be had any more, after {line[:200]}"
        return msgspec.json.decode(answer, type=Outcome)


@contextmanager
def doomed_children(job: Job, folder: Path) -> Iterator[Children]:
    """Start the process that makes children; it has drawn the job once itself."""
    child = subprocess.Popen(
        [sys.executable, "-m", "tests.stress.doomed"],
        cwd=Path(__file__).parents[2],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        children = Children(child)
        children.run(job.order(folder / "rehearsed", "rehearsal"))
        yield children
    finally:
        assert child.stdin is not None
        child.stdin.close()
        child.kill()
        child.wait()
        assert child.stdout is not None
        child.stdout.close()


def check_nothing_is_half(folder: Path, request: SnapshotRequest) -> None:
    """Read every file that has a name, whole."""
    spool, camera = Spool(folder), traced_camera(request)
    size = camera.width, camera.height
    for path in folder.rglob("*"):
        if path.is_dir() or any(part.startswith(HIDDEN) for part in path.parts):
            continue
        record = path.read_bytes()
        if path.name == "status.json":
            msgspec.json.decode(record, type=JobStatus)
        elif path.name == "result.json":
            result = msgspec.json.decode(record, type=SnapshotResult)
            for name, digest in result.digests.items():
                found = hashlib.sha256((path.parent / name).read_bytes())
                assert found.hexdigest() == digest, f"{name} is not the result's"
        elif path.suffix == ".json":
            assert msgspec.json.decode(record, type=SnapshotRequest) == request
        elif path.suffix == ".npy":
            np.load(path, allow_pickle=False)
        elif path.suffix == ".png":
            with PngImage.open(path) as image:
                assert image.size == size
                image.load()
        elif path.name == FILE_NAME:
            GrowingPicture(spool, request.id, *size).update()
        elif path.suffix == ENDING:
            assert unwrap(record) is not None, f"{path} is damaged"
        elif path.parent.name == "data":
            assert hashlib.sha256(record).hexdigest() == path.name
        else:
            assert path.name == "cancel", f"what is {path}?"


def check_done_right(folder: Path, job: Job, most_attempts: int = 2) -> None:
    """Find the job finished, in so many attempts, with the right picture."""
    spool = Spool(folder)
    status = spool.status(job.request.id)
    assert status.state is JobState.DONE, status
    assert 1 <= status.attempt <= most_attempts
    assert not list(spool.queue.glob("*.json"))
    check_nothing_is_half(folder, job.request)
    snapshot = SnapshotClient(folder).wait(job.request.id, timeout_s=1)
    assert snapshot.result.attempt == status.attempt
    found = hashlib.sha256(snapshot.radiance().tobytes()).hexdigest()
    assert found == job.digest, "the picture is not the one that was asked for"


def is_accepted(folder: Path, job: Job) -> bool:
    """Tell whether the spool has the request."""
    spool = Spool(folder)
    claimed = spool.job_folder(job.request.id) / "request.json"
    return claimed.exists() or any(spool.queue.glob(f"*-{job.request.id}.json"))


def heal(folder: Path) -> None:
    """Let a worker that nothing happens to serve the spool until it is quiet."""
    run_worker(folder, once=True, threads=1, lease_s=LEASE_S)


def work_of(job: Job) -> ClassicWork:
    """Get what is drawn."""
    assert isinstance(job.request.work, ClassicWork)
    return job.request.work
