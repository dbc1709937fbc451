"""Kept moments come back as growing pictures, then as files, whatever happens."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from paravol.snapshots.moments import SnapshotRequestFactory
from paravol.snapshots.rendering_service import Worker
from paravol.snapshots.snapshot_queue import (
    MomentPicture,
    SelectedMoment,
    SnapshotQueue,
)
from renderers.art.job_steps import Step, reached
from renderers.scene import AirSurface, Camera, Volume, rmse_codes
from renderers.snapshots.worker import run_worker
from scenarios import FrameState
from system import UserError

PATIENCE_S = 60.0
EDGE = 128


def cave() -> AirSurface:
    """A ball of air, 7 mm in radius, with dents."""
    z, y, x = np.meshgrid(*[np.arange(-10.0, 11)] * 3, indexing="ij")
    dents = 0.8 * np.sin(1.3 * x) * np.sin(1.1 * y) * np.sin(1.2 * z)
    values = (np.sqrt(x * x + y * y + z * z) - 7 + dents).astype(np.float32)
    distance = Volume(values, np.ones(3), np.full(3, -10.0), background=10.0)
    tint = distance.with_values(np.full(values.shape, 90, np.uint8), 0)
    return AirSurface(distance, tint, tint)


def moment(time_s: float) -> SelectedMoment:
    camera = Camera.looking_at([0, 0, 0], [1, 0.2, time_s / 10], size=(EDGE, EDGE))
    return SelectedMoment(
        time_s, FrameState(camera, np.eye(4), np.eye(4), 5.0), 60.0, 3
    )


class Told:
    """Gather what the snapshots shows; wait for the end of moments."""

    def __init__(self) -> None:
        self.pictures: list[MomentPicture] = []
        self._changed = threading.Condition()

    def __call__(self, picture: MomentPicture) -> None:
        with self._changed:
            self.pictures.append(picture)
            self._changed.notify_all()

    def wait_for(self, ends: int) -> None:
        with self._changed:
            came = self._changed.wait_for(
                lambda: sum(p.done is None for p in self.pictures) >= ends, PATIENCE_S
            )
        assert came, f"{ends} moments did not end within {PATIENCE_S:g} s"

    def hold(self, step: Step) -> None:
        """Let no picture be finished before some of it was seen."""
        if step is not Step.PICTURE_SHADED:
            return
        with self._changed:
            came = self._changed.wait_for(self._grows, PATIENCE_S)
        assert came, f"nothing of a picture was seen within {PATIENCE_S:g} s"

    def _grows(self) -> bool:
        last = self.pictures[-1] if self.pictures else None
        return last is not None and last.done is not None and last.pixels is not None


class Alive(Worker):
    """A worker in a thread of this process: there is no child to die."""

    def __init__(self) -> None:
        pass

    def ensure_alive(self) -> None:
        pass


@contextmanager
def served_here(spool: Path) -> Iterator[Worker]:
    done = threading.Event()
    thread = threading.Thread(
        target=run_worker, args=(spool,), kwargs={"stopped": done.is_set}
    )
    thread.start()
    try:
        yield Alive()
    finally:
        done.set()
        thread.join(PATIENCE_S)


def test_moments_grow_one_after_the_other_and_are_saved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = Told()
    monkeypatch.setattr(reached, "watcher", told.hold)
    requests = SnapshotRequestFactory(cave(), 1.45, 7, has_instrument=False)
    with SnapshotQueue(
        requests, tmp_path / "snapshots", told, served_here
    ) as snapshots:
        live = np.full((EDGE, EDGE, 3), 90, np.uint8)
        snapshots.draw(replace(moment(1.25), live=live))
        snapshots.draw(moment(2.5))
        told.wait_for(2)
    times = [picture.time_s for picture in told.pictures]
    assert times == sorted(times)
    for time_s in (1.25, 2.5):
        mine = [picture for picture in told.pictures if picture.time_s == time_s]
        file = tmp_path / "snapshots" / f"moment-{time_s:.2f}.png"
        assert mine[-1].message == str(file)
        saved = np.asarray(Image.open(file))
        assert saved.shape == (EDGE, EDGE, 3)
        assert saved.std() > 5
        assert mine[-1].pixels is not None
        assert np.array_equal(mine[-1].pixels, saved)
        off_by = None if time_s > 2.0 else rmse_codes(live, saved)
        assert mine[-1].rmse == off_by
        shares = [picture.done for picture in mine[:-1] if picture.done is not None]
        assert shares == sorted(shares)
        # Shown before it was finished, already much like it is in the end.
        grown = [p.pixels for p in mine[:-1] if p.pixels is not None]
        assert grown
        off = np.abs(grown[-1].astype(float) - saved).mean()
        assert off < 0.4 * saved.mean()


def test_a_worker_that_dies_is_told_and_the_desk_goes_on(tmp_path: Path) -> None:
    class Dead(Worker):
        def __init__(self) -> None:
            pass

        def ensure_alive(self) -> None:
            raise UserError("The snapshot worker ended with status 9.")

    @contextmanager
    def nobody(spool: Path) -> Iterator[Worker]:
        yield Dead()

    told = Told()
    requests = SnapshotRequestFactory(cave(), 1.45, 7, has_instrument=False)
    with SnapshotQueue(requests, tmp_path / "snapshots", told, nobody) as snapshots:
        snapshots.draw(moment(1.0))
        snapshots.draw(moment(2.0))
        told.wait_for(2)
    ends = [picture for picture in told.pictures if picture.done is None]
    assert [end.message for end in ends] == [
        "The snapshot worker ended with status 9."
    ] * 2
    assert all(end.pixels is None for end in ends)
    assert not (tmp_path / "snapshots").exists()


def test_a_worker_that_cannot_start_is_told(tmp_path: Path) -> None:
    @contextmanager
    def none(spool: Path) -> Iterator[Worker]:
        if spool.parent.exists():
            raise FileNotFoundError(2, "No such file or directory", "python")
        yield Alive()

    told = Told()
    requests = SnapshotRequestFactory(cave(), 1.45, 7, has_instrument=False)
    with SnapshotQueue(requests, tmp_path, told, none) as snapshots:
        snapshots.draw(moment(1.0))
        told.wait_for(1)
    assert "No such file" in told.pictures[-1].message


@pytest.mark.parametrize("draws", [False, True])
def test_closing_gives_up_what_is_not_finished(tmp_path: Path, draws: bool) -> None:
    told = Told()
    requests = SnapshotRequestFactory(cave(), 1.45, 7, has_instrument=False)
    snapshots = SnapshotQueue(requests, tmp_path / "snapshots", told, served_here)
    if draws:
        snapshots.draw(moment(1.0))
        snapshots.draw(moment(2.0))
    snapshots.close()
    snapshots.close()
    assert not any(picture.time_s == 2.0 for picture in told.pictures)
    assert not any(
        picture.done is None and picture.pixels is None for picture in told.pictures
    )
