"""Snapshots whose light is followed by paths: they end, stop, and go on."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderers.scene import Camera, Scene
from renderers.snapshots.client import Snapshot, SnapshotClient, SnapshotError
from renderers.snapshots.delivery import Attempt, Finisher, eye_codes, in_field
from renderers.snapshots.request import PathTracingSpec
from renderers.snapshots.team import SerialTeam
from renderers.snapshots.worker import run_worker


def drawn(
    client: SnapshotClient,
    scene: Scene,
    camera: Camera,
    path_tracing: PathTracingSpec | None,
    deliver_after_s: float | None = None,
) -> Snapshot:
    assert scene.surface is not None
    request = client.request_scope(
        scene.surface,
        camera,
        samples=1,
        path_tracing=path_tracing,
        deliver_after_s=deliver_after_s,
        gain=1.0,
    )
    job = client.submit(request)
    run_worker(client.spool.folder, once=True)
    return client.wait(job)


@pytest.fixture(scope="module")
def camera(inside: Camera) -> Camera:
    return inside.with_size(32, 32)


def test_it_ends_when_its_paths_are_walked_or_its_noise_is_low(
    client: SnapshotClient, scene: Scene, camera: Camera
) -> None:
    few = drawn(client, scene, camera, PathTracingSpec(paths=48))
    assert few.result.complete
    seen = few.samples()[few.coverage() > 0]
    assert set(np.unique(seen % 16)) == {0}
    assert seen.min() >= 32
    blocks = few.samples()[::16, ::16]
    assert blocks[blocks > 0].mean() == 48
    assert few.result.noise is not None
    assert few.result.noise > 0
    low = drawn(client, scene, camera, PathTracingSpec(paths=2**20, noise=0.15))
    assert low.result.complete
    assert low.result.noise is not None
    assert low.result.noise <= 0.15
    quick = drawn(client, scene, camera, None)
    assert quick.result.noise is None
    assert not np.array_equal(quick.radiance(), few.radiance())
    assert_array_equal(quick.depth_mm(), few.depth_mm())
    lit = quick.radiance().mean()
    assert few.radiance().mean() == pytest.approx(lit, rel=0.3)


def test_stopped_at_once_it_shows_the_quick_light_and_says_so(
    client: SnapshotClient, scene: Scene, camera: Camera
) -> None:
    cut = drawn(client, scene, camera, PathTracingSpec(), deliver_after_s=1e-9)
    assert not cut.result.complete
    assert cut.result.noise is None
    assert not cut.samples().any()


def test_stopped_between_it_tells_what_the_quick_light_is_off_by(
    tmp_path: Path, scene: Scene, camera: Camera
) -> None:
    """As long as its noise is not known; by those of its walls that have paths."""
    assert scene.surface is not None
    client = SnapshotClient(tmp_path / "spool")
    request = client.request_scope(
        scene.surface,
        camera.with_size(64, 64),
        samples=1,
        path_tracing=PathTracingSpec(),
        gain=1e3,
    )
    finisher = Finisher(client.spool.data, 1)
    traced = SerialTeam(1).trace(request, scene, lambda share: True)
    looks: list[bool] = []

    def enough() -> bool:
        looks.append(True)
        return len(looks) > 2

    part = finisher.finish(request, scene, traced, Attempt(enough=enough))
    assert not part.complete
    assert part.noise is None
    assert 0 < np.count_nonzero(part.samples) < part.samples.size
    assert part.error is not None
    work = msgspec.structs.replace(request.work, path_tracing=None)
    quick = finisher.finish(msgspec.structs.replace(request, work=work), scene, traced)
    assert quick.error is None
    told = (part.samples > 0) & in_field(part.coverage)
    off = eye_codes(part.radiance, 1e3)[told] - eye_codes(quick.radiance, 1e3)[told]
    assert part.error == pytest.approx(np.sqrt((off**2).mean()), rel=1e-5)
    assert part.error > 0
    finisher.close()


def test_going_on_is_never_having_stopped(
    client: SnapshotClient, scene: Scene, camera: Camera
) -> None:
    whole = drawn(client, scene, camera, PathTracingSpec(paths=96))
    part = drawn(client, scene, camera, PathTracingSpec(paths=48))
    state = client.put(part.state())
    rest = drawn(client, scene, camera, PathTracingSpec(paths=96, state=state))
    assert rest.radiance().tobytes() == whole.radiance().tobytes()
    assert_array_equal(rest.samples(), whole.samples())
    assert rest.result.noise == whole.result.noise


def test_the_state_of_another_view_is_refused(
    client: SnapshotClient, scene: Scene, camera: Camera
) -> None:
    part = drawn(client, scene, camera, PathTracingSpec(paths=32))
    state = client.put(part.state())
    with pytest.raises(SnapshotError, match=r"goes on from float64 \(24, 24, 7\)"):
        drawn(client, scene, camera.with_size(24, 24), PathTracingSpec(state=state))
