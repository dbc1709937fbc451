"""A picture at any moment: coarse first, then ray by ray as it shall be."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from renderers.art.job import ImageSpec, SnapshotRequest
from renderers.art.team import Progress, Team, Traced, traced_camera
from renderers.art.tracer import RenderStoppedError
from renderers.scene import GBuffer, Image, Scene

COARSER = 4
"""Rays along a side that one ray of the coarse picture stands for: it costs 6 %."""

SMALLEST_PX = 8
"""Pictures smaller than this are not asked for."""


def trace_best(
    team: Team,
    request: SnapshotRequest,
    scene: Scene,
    progress: Progress,
    enough: Callable[[], bool],
) -> Traced:
    """Trace a request; what there is when `enough` says so is the picture.

    Raise RenderStoppedError when `progress` says so, or nothing can be had.
    """
    coarse = None
    if request.progressive:
        coarse = _coarse(team, request, scene, progress, enough)
    try:
        return team.trace(request, scene, _until(progress, enough))
    except RenderStoppedError as stop:
        if not enough() or stop.partial is None or stop.done is None:
            raise
        found = stop.partial
        if coarse is not None:
            found = fill(found, stop.done, coarse)
        return Traced(found, {}, stop.done)


def coarse_request(request: SnapshotRequest) -> SnapshotRequest | None:
    """Ask for a sixteenth of the rays; None where the picture is too small for that."""
    camera = traced_camera(request)
    width, height = -(-camera.width // COARSER), -(-camera.height // COARSER)
    if min(width, height) < SMALLEST_PX:
        return None
    return msgspec.structs.replace(
        request, image=ImageSpec(width, height, 1), progressive=False
    )


def fill(
    found: GBuffer | Image, done: NDArray[np.bool_], coarse: GBuffer | Image
) -> GBuffer | Image:
    """Show a coarser picture of the same view where a picture is not done yet."""
    rows, columns = (
        _nearest(size, other, min(found.size), min(coarse.size))
        for size, other in zip(found.size, coarse.size, strict=True)
    )

    def mixed(fine: NDArray[Any], rough: NDArray[Any]) -> NDArray[Any]:
        mask = done.reshape(done.shape + (1,) * (fine.ndim - 2))
        return np.where(mask, fine, rough[rows[:, None], columns])

    if isinstance(found, Image):
        assert isinstance(coarse, Image)
        assert found.depth_mm is not None
        assert coarse.depth_mm is not None
        return Image(
            mixed(found.rgba, coarse.rgba), mixed(found.depth_mm, coarse.depth_mm)
        )
    assert isinstance(coarse, GBuffer)
    return replace(
        found,
        depth_mm=mixed(found.depth_mm, coarse.depth_mm),
        normal=mixed(found.normal, coarse.normal),
        coverage=mixed(found.coverage, coarse.coverage),
        material=mixed(found.material, coarse.material),
    )


def _coarse(
    team: Team,
    request: SnapshotRequest,
    scene: Scene,
    progress: Progress,
    enough: Callable[[], bool],
) -> GBuffer | Image | None:
    rough = coarse_request(request)
    if rough is None:
        return None

    def go_on(_: float) -> bool:
        return progress(0.0) and not enough()

    try:
        return team.trace(rough, scene, go_on).found
    except RenderStoppedError as stop:
        if not enough():
            raise
        return stop.partial


def _until(progress: Progress, enough: Callable[[], bool]) -> Progress:
    return lambda share: progress(share) and not enough()


def _nearest(size: int, other: int, short: int, other_short: int) -> NDArray[np.intp]:
    """Find the coarse pixel whose centre lies nearest to each fine one's.

    short: the pictures' shorter sides, which the lens's field falls on.
    """
    at = (np.arange(size) + 0.5 - size / 2) * (other_short / short) + other / 2
    nearest: NDArray[np.intp] = np.clip(np.floor(at), 0, other - 1).astype(np.intp)
    return nearest
