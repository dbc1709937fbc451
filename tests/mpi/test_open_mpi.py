"""Open MPI instead of MPICH: the same bits; skipped where it is not installed.

The whole of this folder runs under it with PARAVOL_MPIEXEC=mpiexec.openmpi.
"""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from renderers.art import ActiveRayTracer
from renderers.scene import Camera, Projection, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.launcher import launcher_at
from tests.mpi.launching import NEEDS_RANKS, ranks, wait_until_gone

PATH = shutil.which("mpiexec.openmpi") or shutil.which("mpiexec")

pytestmark = [
    *NEEDS_RANKS,
    pytest.mark.slow,
    pytest.mark.skipif(
        PATH is None or not launcher_at(PATH).is_open_mpi, reason="there is no Open MPI"
    ),
]


@pytest.mark.parametrize("number", [2, 5])
def test_open_mpi_draws_the_same_bits(
    tmp_path: Path, scene: Scene, number: int
) -> None:
    assert PATH is not None
    launcher = launcher_at(PATH)
    client = SnapshotClient(tmp_path / "spool")
    camera = Camera.looking_at(
        [30, -20, 10],
        [0, 0, 0],
        extent=0.5,
        size=(90, 70),
        projection=Projection.PERSPECTIVE,
    )
    values = scene.volume.values.copy()
    values[8:19, 12:25, 10:22] = -300
    edited = replace(scene, volume=scene.volume.with_values(values, -300))
    jobs = [client.submit(client.request_classic(s, camera)) for s in (scene, edited)]
    options = ["--once", "--cache-cells", "60"]
    with ranks(number, client.spool.folder, *options, launcher=launcher) as child:
        snapshots = [client.wait(job, timeout_s=120) for job in jobs]
        said, _ = child.communicate(timeout=30)
        assert (said, child.returncode) == ("", 0)
    for drawn, snapshot in zip((scene, edited), snapshots, strict=True):
        expected = ActiveRayTracer(drawn, threads=1).render(camera)
        assert snapshot.result.ranks == number
        assert snapshot.result.counters["requests"] > 0
        assert snapshot.radiance().tobytes() == expected.rgba.tobytes()
    wait_until_gone(client.spool.folder)
