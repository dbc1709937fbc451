"""Ranks as processes, joined by a real message-passing library."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.ranks.orbits import folded_scene, orbit
from renderers.art import ActiveRayTracer
from renderers.scene import Camera, Projection, Scene
from renderers.snapshots.client import SnapshotClient, SnapshotError
from renderers.snapshots.request import QualityName
from tests.mpi.launching import (
    NEEDS_RANKS,
    rank_process,
    ranks,
    ranks_command,
    running,
    wait_until_gone,
)

pytestmark = NEEDS_RANKS


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
        (2, "shared", None),
        pytest.param(2, "static", 9, marks=pytest.mark.slow),
        pytest.param(2, "replicated", 9, marks=pytest.mark.slow),
        pytest.param(3, "migrating", 36, marks=pytest.mark.slow),
        pytest.param(4, "migrating", 26, marks=pytest.mark.slow),
        pytest.param(4, "shared", None, marks=pytest.mark.slow),
        pytest.param(7, "migrating", 20, marks=pytest.mark.slow),
    ],
)
def test_ranks_draw_the_same_bits_as_one_process(
    tmp_path: Path,
    scene: Scene,
    camera: Camera,
    number: int,
    dataflow: str,
    cells: int | None,
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
    options = ["--once"]
    if cells is not None:
        options += ["--cache-cells", str(cells), "--dataflow", dataflow]
    with ranks(number, client.spool.folder, *options) as child:
        snapshots = [client.wait(job, timeout_s=120) for job in jobs]
        said, _ = child.communicate(timeout=30)
        assert (said, child.returncode) == ("", 0)
    for (drawn, quality), snapshot in zip(asked, snapshots, strict=True):
        expected = ActiveRayTracer(drawn, quality, threads=1).render(camera)
        assert snapshot.result.ranks == number
        sent = snapshot.result.counters["requests"]
        assert (sent == 0) == (dataflow in ("replicated", "shared"))
        assert snapshot.result.counters["shared_memory"] == (dataflow == "shared")
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


def test_the_memory_that_a_rank_may_take_says_how_many_cells_it_keeps(
    tmp_path: Path,
) -> None:
    """Bricks, and values to be handed on; too little is refused with the bytes."""
    scene, (camera,) = folded_scene(64), orbit(64, 48, 1)
    client = SnapshotClient(tmp_path / "spool")
    expected = ActiveRayTracer(scene, "snapshot", threads=1).render(camera)
    for way, gigabytes, cells in (
        ("migrating", "0.0029", 309),
        ("migrating", "0.0001", None),
        # together it is enough for all
        ("shared", "0.0016", 8),
    ):
        job = client.submit(client.request_classic(scene, camera))
        options = "--once", "--dataflow", way, "--memory-gb", gigabytes
        with ranks(2, client.spool.folder, *options) as child:
            if cells is None:
                with pytest.raises(
                    SnapshotError, match=r"needs at least [0-9,]+ bytes"
                ):
                    client.wait(job, timeout_s=120)
            else:
                snapshot = client.wait(job, timeout_s=120)
                assert snapshot.radiance().tobytes() == expected.rgba.tobytes()
                counters = snapshot.result.counters
                assert counters["cache_cells"] == cells
                side = 32 if way == "shared" else 8
                assert counters["cache_bytes"] == cells * (side + 1) ** 3 * 8
            child.communicate(timeout=30)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits of a process are Linux's")
@pytest.mark.parametrize("options", [(), ("--from-file",)])
def test_ranks_draw_from_its_file_what_none_of_them_could_hold(
    tmp_path: Path, options: tuple[str, ...]
) -> None:
    """Each may take 1.4 GB, libraries and the mapped volume included."""
    side = 448
    scene, (camera,) = folded_scene(side), orbit(side, 64, 1)
    client = SnapshotClient(tmp_path / "spool")
    job = client.submit(client.request_classic(scene, camera))
    tracer = ActiveRayTracer(scene, "snapshot", threads=2)
    expected = tracer.render(camera)
    words = ["-m", "renderers.snapshots", "--spool", str(client.spool.folder)]
    command = ranks_command(4, *words, "--once", *options)
    limited = ["sh", "-c", 'ulimit -v "$0" && exec "$@"', "1400000", *command]
    with running(limited) as child:
        snapshot = client.wait(job, timeout_s=300)
        said, _ = child.communicate(timeout=30)
    assert (said, child.returncode) == ("", 0)
    assert snapshot.radiance().tobytes() == expected.rgba.tobytes()
    counters = snapshot.result.counters
    assert counters["cache_bytes"] < 700e6
    wait_until_gone(client.spool.folder)
