"""Ranks on two machines: here two network namespaces, each with its own address."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.ranks.mpi_frames import RankJob, digest_of, run_ranks
from benchmarks.ranks.orbits import folded_scene, orbit
from renderers.art import ActiveRayTracer
from renderers.art.regions import Gather
from renderers.snapshots.client import SnapshotClient
from tests.mpi.launching import LAUNCHER, NEEDS_RANKS, running, wait_until_gone

pytestmark = [*NEEDS_RANKS, pytest.mark.slow]

SHELL = """#!/bin/sh
# Stands for ssh: an address, then a command.
while [ "${1#-}" != "$1" ]; do shift; done
case "$1" in
    10.77.0.1) name=%s ;;
    10.77.0.2) name=%s ;;
    *) echo "no host $1" >&2; exit 1 ;;
esac
shift
# MPICH tells machines apart by their names.
exec ip netns exec "$name" unshare --uts sh -c "hostname $name && $*"
"""


def ip(*words: str) -> None:
    subprocess.run(["ip", *words], check=True, capture_output=True, timeout=20)


@pytest.fixture
def hosts(tmp_path: Path) -> Iterator[tuple[str, Path]]:
    """Make two hosts joined by a cable; give the first's name and the shell."""
    if shutil.which("ip") is None or os.geteuid() != 0:
        pytest.skip("network namespaces need root and iproute2")
    names = [f"paravol-{os.getpid()}-{n}" for n in (1, 2)]
    made = []
    try:
        try:
            for name in names:
                ip("netns", "add", name)
                made.append(name)
            ends = [f"pv{os.getpid()}a", f"pv{os.getpid()}b"]
            peer = ("peer", "name", ends[1], "netns", names[1])
            ip("link", "add", ends[0], "netns", names[0], "type", "veth", *peer)
            for n, (name, end) in enumerate(zip(names, ends, strict=True), 1):
                ip("-n", name, "addr", "add", f"10.77.0.{n}/24", "dev", end)
                ip("-n", name, "link", "set", end, "up")
                ip("-n", name, "link", "set", "lo", "up")
        except subprocess.CalledProcessError as error:
            pytest.skip(f"no network namespaces here: {error.stderr.decode()}")
        shell = tmp_path / "shell"
        shell.write_text(SHELL % tuple(names))
        shell.chmod(0o755)
        yield names[0], shell
    finally:
        for name in made:
            ip("netns", "del", name)


def placing(shell: Path) -> list[str]:
    """Tell the launcher to put two ranks on each host, by that shell."""
    assert LAUNCHER is not None
    if LAUNCHER.is_open_mpi:
        words = ["--mca", "plm_rsh_agent", str(shell)]
        words += ["--mca", "btl_tcp_if_include", "10.77.0.0/24"]
        return [*words, "--host", "10.77.0.1:2,10.77.0.2:2"]
    words = ["-launcher", "ssh", "-launcher-exec", str(shell)]
    return [*words, "-hosts", "10.77.0.1,10.77.0.2", "-ppn", "2"]


@pytest.mark.parametrize("dataflow", ["migrating", "static"])
def test_ranks_on_two_hosts_draw_the_same_bits(
    tmp_path: Path, hosts: tuple[str, Path], dataflow: str
) -> None:
    first, shell = hosts
    scene, cameras = folded_scene(40), orbit(40, 96, 2)
    client = SnapshotClient(tmp_path)
    requests = tuple(client.request_classic(scene, camera) for camera in cameras)
    cells = 100 if dataflow == "migrating" else None
    reports = run_ranks(
        4,
        RankJob(requests=requests, dataflow=dataflow, cache_cells=cells),
        tmp_path,
        *("ip", "netns", "exec", first),
        options=placing(shell),
    )
    # Nearest is oneself, then the same host, then the other.
    assert [report.distances for report in reports] == [
        (0, 1, 2, 2),
        (1, 0, 2, 2),
        (2, 2, 0, 1),
        (2, 2, 1, 0),
    ]
    tracer = ActiveRayTracer(scene, "snapshot", threads=1)
    for frame, camera in zip(reports[0].rounds[0], cameras, strict=True):
        image = tracer.render(camera)
        assert image.depth_mm is not None
        gather = Gather(camera.width, camera.height)
        gather.value, gather.depth = image.rgba, image.depth_mm
        assert frame.digest == digest_of(gather)


def test_one_rank_works_for_each_host_and_draws_the_same_bits(
    tmp_path: Path, hosts: tuple[str, Path]
) -> None:
    """Four are started. With an edit between, and what was kept goes on."""
    first, shell = hosts
    scene, cameras = folded_scene(64), orbit(64, 96, 3)
    values = scene.volume.values.copy()
    values[8:19, 12:25, 10:22] = values.min()
    edited = replace(scene, volume=scene.volume.with_values(values, values.min()))
    client = SnapshotClient(tmp_path / "spool")
    drawn = list(zip((scene, edited, scene), cameras, strict=True))
    jobs = [client.submit(client.request_classic(*one)) for one in drawn]
    assert LAUNCHER is not None
    words = [sys.executable, "-m", "mpi4py", "-m", "renderers.snapshots", "--once"]
    command = [*LAUNCHER.command(4, *placing(shell)), *words]
    spool = str(client.spool.folder)
    with running(["ip", "netns", "exec", first, *command, "--spool", spool]) as child:
        snapshots = [client.wait(job, timeout_s=120) for job in jobs]
        said, _ = child.communicate(timeout=30)
    assert (said, child.returncode) == ("", 0)
    for (one, camera), snapshot in zip(drawn, snapshots, strict=True):
        expected = ActiveRayTracer(one, "snapshot", threads=1).render(camera)
        assert snapshot.radiance().tobytes() == expected.rgba.tobytes()
        counters = snapshot.result.counters
        assert snapshot.result.ranks == 2
        assert counters["threads"] == 2 * len(os.sched_getaffinity(0))
        assert counters["cells_fetched"] > 0
        assert counters["shared_memory"] == 0
    wait_until_gone(client.spool.folder)
