"""Ranks as processes, joined by a real message-passing library."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from renderers.art import ActiveRayTracer
from renderers.art.client import QualityName, SnapshotClient
from renderers.scene import (
    Camera,
    Projection,
    Scene,
)

pytest.importorskip("mpi4py")
MPIEXEC = Path(sys.executable).with_name("mpiexec")
pytestmark = [
    pytest.mark.mpi,
    pytest.mark.skipif(not MPIEXEC.exists(), reason="there is no mpiexec"),
]


@contextmanager
def ranks(number: int, spool: Path, *options: str) -> Iterator["subprocess.Popen[str]"]:
    command = [str(MPIEXEC), "-n", str(number), sys.executable, "-m", "mpi4py"]
    command += ["-m", "renderers.art", "--spool", str(spool), *options]
    child = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        yield child
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
        child.communicate()


def processes_of(spool: Path) -> list[int]:
    """List living processes whose command line names a spool."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0")
            state = (entry / "stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            continue
        if str(spool).encode() in words and state != "Z":
            found.append(int(entry.name))
    return found


def wait_until_gone(spool: Path, seconds: float = 30) -> None:
    deadline = time.monotonic() + seconds
    while processes_of(spool):
        assert time.monotonic() < deadline, "processes were left behind"
        time.sleep(0.1)


@pytest.fixture(scope="module")
def camera() -> Camera:
    """Get a view from outside."""
    return Camera.looking_at(
        [30, -20, 10],
        [0, 0, 0],
        extent=0.5,
        size=(90, 70),
        projection=Projection.PERSPECTIVE,
    )


@pytest.mark.parametrize(
    ("number", "dataflow", "cells"),
    [
        (2, "migrating", 60),
        pytest.param(2, "static", 9, marks=pytest.mark.slow),
        pytest.param(2, "replicated", 9, marks=pytest.mark.slow),
        pytest.param(3, "migrating", 36, marks=pytest.mark.slow),
        pytest.param(4, "migrating", 26, marks=pytest.mark.slow),
        pytest.param(7, "migrating", 20, marks=pytest.mark.slow),
    ],
)
def test_ranks_draw_the_same_bits_as_one_process(
    tmp_path: Path,
    scene: Scene,
    camera: Camera,
    number: int,
    dataflow: str,
    cells: int,
) -> None:
    client = SnapshotClient(tmp_path / "spool")
    values = scene.volume.values.copy()
    values[8:19, 12:25, 10:22] = -300
    edited = replace(scene, volume=scene.volume.with_values(values, -300))
    asked: list[tuple[Scene, QualityName]] = [
        (scene, "snapshot"),
        (edited, "snapshot"),
        (scene, "preview"),
    ]
    jobs = [
        client.submit(client.request_classic(s, camera, quality=q)) for s, q in asked
    ]
    options = ["--once", "--cache-cells", str(cells), "--dataflow", dataflow]
    with ranks(number, client.spool.folder, *options) as child:
        snapshots = [client.wait(job, timeout_s=120) for job in jobs]
        said, _ = child.communicate(timeout=30)
        assert (said, child.returncode) == ("", 0)
    for (drawn, quality), snapshot in zip(asked, snapshots, strict=True):
        expected = ActiveRayTracer(drawn, quality, threads=1).render(camera)
        assert snapshot.result.ranks == number
        sent = snapshot.result.counters["requests"]
        assert (sent == 0) == (dataflow == "replicated")
        assert snapshot.radiance().tobytes() == expected.rgba.tobytes()
    wait_until_gone(client.spool.folder)


@pytest.mark.slow
@pytest.mark.parametrize("victim", [0, 2])
def test_a_job_survives_the_death_of_a_rank(
    tmp_path: Path, scene: Scene, camera: Camera, victim: int
) -> None:
    client = SnapshotClient(tmp_path / "spool", lease_s=60)
    large = camera.with_size(700, 560)
    job = client.submit(client.request_classic(scene, large, quality="final"))
    folder = client.spool.job_folder(job)
    with ranks(3, client.spool.folder) as child:
        while not 0 < client.spool.status(job).done < 0.8:
            assert not client.spool.status(job).state.is_final, "it was too quick"
            time.sleep(0.002)
        os.kill(rank_process(client.spool.folder, victim), signal.SIGKILL)
        # One dead rank ends them all; nothing half-made can be seen.
        child.communicate(timeout=60)
        assert child.returncode != 0
    wait_until_gone(client.spool.folder)
    assert not client.spool.status(job).state.is_final
    assert not {"picture.png", "result.json"} & {path.name for path in folder.iterdir()}
    with ranks(2, client.spool.folder, "--lease", "1"):
        snapshot = client.wait(job, timeout_s=120)
    expected = ActiveRayTracer(scene, "final", threads=1).render(large)
    assert snapshot.result.attempt == 2
    assert snapshot.radiance().tobytes() == expected.rgba.tobytes()
    wait_until_gone(client.spool.folder)


def rank_process(spool: Path, number: int) -> int:
    """Find a rank's process by what its launcher told it."""
    for pid in processes_of(spool):
        told = (Path("/proc") / str(pid) / "environ").read_bytes().split(b"\0")
        if b"PMI_RANK=%d" % number in told:
            return pid
    raise AssertionError(f"there is no rank {number}")


def test_ranks_say_in_one_sentence_why_they_cannot_serve(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    with ranks(2, file) as child:
        said, _ = child.communicate(timeout=60)
    assert child.returncode == 1
    assert said.splitlines()[0] == f"Spool {file} cannot be used: File exists."
    assert "Traceback" not in said
    wait_until_gone(file)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_ranks_end_on_a_signal_and_leave_no_process(
    tmp_path: Path, number: signal.Signals
) -> None:
    spool = tmp_path / "spool"
    with ranks(2, spool) as child:
        while not (spool / "data").exists():
            assert child.poll() is None
            time.sleep(0.05)
        child.send_signal(number)
        said, _ = child.communicate(timeout=30)
        assert "Traceback" not in said
    wait_until_gone(spool)


@pytest.mark.slow
def test_ranks_end_with_their_parent(tmp_path: Path) -> None:
    parent = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    spool = tmp_path / "spool"
    with ranks(2, spool, "--parent", str(parent.pid)) as child:
        while not (spool / "data").exists():
            assert child.poll() is None
            time.sleep(0.05)
        parent.kill()
        parent.wait()
        said, _ = child.communicate(timeout=30)
        assert (said, child.returncode) == ("", 0)
    assert parent.stdin is not None
    parent.stdin.close()
    wait_until_gone(spool)


def test_ranks_end_when_their_launcher_is_killed(tmp_path: Path) -> None:
    spool = tmp_path / "spool"
    with ranks(2, spool) as child:
        while not (spool / "data").exists():
            assert child.poll() is None
            time.sleep(0.05)
        child.kill()
        child.wait()
        wait_until_gone(spool)
