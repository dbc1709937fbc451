"""A picture at any moment: coarse first, then ray by ray as it shall be."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import msgspec

from renderers.art.tracer import RenderStoppedError
from renderers.scene import GBuffer, Image, Scene
from renderers.snapshots.filling import fill
from renderers.snapshots.preview import Preview
from renderers.snapshots.request import ImageSpec, SnapshotRequest
from renderers.snapshots.saved_work import SavedWork
from renderers.snapshots.team import Progress, Team
from renderers.snapshots.traced import Tools, Traced, empty_gather, traced_camera

COARSER = (16, 4)
"""Rays along a side that one ray of a coarse picture stands for: .4 and 6 % of them."""

SMALLEST_PX = 8
"""Pictures smaller than this are not asked for."""


def trace_best(
    team: Team,
    request: SnapshotRequest,
    scene: Scene,
    progress: Progress,
    enough: Callable[[], bool],
    preview: Preview | None = None,
    saved: SavedWork | None = None,
    tools: Tools = (),
) -> Traced:
    """Trace a request; what there is when `enough` says so is the picture.

    There is always a picture of a progressive request: the coarsest is finished
    whatever `enough` says, and so is one that is too small for a coarser one.
    preview: shows coarse pictures, then parts of the picture, where it is progressive.
    saved: what an earlier attempt found is not traced again; those rays are counted as
    `rays_kept`. tools: as `Team` takes them.
    Raise RenderStoppedError when `progress` says so, or nothing can be had.
    """
    cost = Counter[str]()
    coarse: GBuffer | Image | None = None
    sides = 1
    for rough in coarse_requests(request):
        coarse, is_whole = _coarse(
            team, rough, scene, progress, enough, cost, coarse, tools
        )
        if is_whole:
            sides = -(-traced_camera(request).width // rough.image.width)
        if enough():
            break
        if preview:
            preview.show_coarse(rough, coarse)
    if request.progressive and coarse is None:
        enough = _never
    gather = empty_gather(request)
    look = _until(progress, enough)
    if saved:
        cost["rays_kept"] = saved.restore(gather)
        look = saved.watching(gather, look)
    if preview:
        look = preview.looking_at(gather, look)
    try:
        traced = team.trace(request, scene, look, gather, tools)
        cost.update(traced.counters)
        return replace(traced, counters=dict(cost))
    except RenderStoppedError as stop:
        if not enough() or stop.partial is None or stop.done is None:
            raise
        found = stop.partial
        if stop.done.all():
            return Traced(found, dict(cost))
        if coarse is not None:
            found = fill(found, stop.done, coarse)
        return Traced(found, dict(cost), stop.done, coarse=sides)


def coarse_requests(request: SnapshotRequest) -> list[SnapshotRequest]:
    """Ask for pictures of fewer rays, the coarsest first.

    There are none where the picture is not progressive, or too small for that.
    """
    if not request.progressive:
        return []
    camera = traced_camera(request)
    sizes = [(-(-camera.width // n), -(-camera.height // n)) for n in COARSER]
    return [
        msgspec.structs.replace(request, image=ImageSpec(*size, 1), progressive=False)
        for size in sizes
        if min(size) >= SMALLEST_PX
    ]


def _coarse(
    team: Team,
    request: SnapshotRequest,
    scene: Scene,
    progress: Progress,
    enough: Callable[[], bool],
    cost: Counter[str],
    coarser: GBuffer | Image | None,
    tools: Tools,
) -> tuple[GBuffer | Image, bool]:
    """Trace a coarse picture; give it, and whether all of it was traced."""

    def go_on(_: float) -> bool:
        return progress(0.0) and (coarser is None or not enough())

    try:
        traced = team.trace(request, scene, go_on, tools=tools)
        cost.update(traced.counters)
        return traced.found, True
    except RenderStoppedError as stop:
        if coarser is None or stop.partial is None or stop.done is None:
            raise
        if not enough():
            raise
        return fill(stop.partial, stop.done, coarser), False


def _never() -> bool:
    return False


def _until(progress: Progress, enough: Callable[[], bool]) -> Progress:
    return lambda share: progress(share) and not enough()
