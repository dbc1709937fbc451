"""Light by random paths for a snapshot: until it is good enough, or has to be."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.art.tracer import RenderStoppedError
from renderers.scene import AirSurface
from renderers.shading.path_sampling import PathSampling
from renderers.shading.path_tracer import BATCH_PATHS, PathLight, PathTracer, SeenWalls
from renderers.snapshots.data_store import DataStore
from renderers.snapshots.request import PathTracingSpec, ScopeWork, SnapshotRequest
from renderers.snapshots.saved_work import SavedWork
from renderers.snapshots.team import Progress

LARGEST_STATE = 8 << 30
"""Bytes of a state accepted."""

LOOK_EVERY = 8
"""Batches of blocks between two looks at the noise and at the spool: some 50 ms."""


@dataclass(frozen=True, slots=True)
class PathTracedLight:
    """Hold what paths found; see `SnapshotResult` for complete and noise."""

    light: PathLight
    complete: bool
    noise: float | None
    state: NDArray[np.float64]

    @property
    def batches(self) -> NDArray[np.int32]:
        """Return the batches of each ray, ``(h, w)``."""
        assert self.light.batches is not None
        return self.light.batches


def path_tracing_of(request: SnapshotRequest) -> PathTracingSpec | None:
    """Return a request's path tracing, None in other modes."""
    return request.work.path_tracing if isinstance(request.work, ScopeWork) else None


def follow_light(
    data: DataStore,
    work: ScopeWork,
    surface: AirSurface,
    walls: SeenWalls,
    threads: int,
    go_on: Progress,
    enough: Callable[[], bool],
    saved: SavedWork | None = None,
) -> PathTracedLight:
    """Walk paths until noise or number is reached, or `enough` says so.

    saved: of an earlier attempt, to go on from. Raise RenderStoppedError when `go_on`
    says so, ValueError for a state that is not this view's.
    """
    spec = work.path_tracing
    assert spec is not None
    state = None if saved is None else saved.paths()
    if state is None and spec.state is not None:
        state = np.asarray(data.get(spec.state, ("float64",), LARGEST_STATE))
    tracer = PathTracer(
        surface, blood_bias=work.blood_bias, seed=work.seed, threads=threads
    )
    try:
        sampling = PathSampling(tracer, walls, state)
        most = sampling.blocks * -(-spec.paths // BATCH_PATHS)
        while True:
            noise, done = sampling.noise(), sampling.batches
            if not go_on(0.05 + 0.95 * min(done / max(most, 1), 1.0)):
                raise RenderStoppedError()
            complete = noise <= spec.noise or (sampling.is_complete and done >= most)
            if complete or enough():
                known = noise if np.isfinite(noise) else None
                return PathTracedLight(
                    sampling.light(), complete, known, sampling.state()
                )
            if saved is not None:
                saved.watch_paths(sampling.state)
            for _ in range(min(LOOK_EVERY, max(most - done, 1))):
                sampling.step()
    finally:
        tracer.close()
