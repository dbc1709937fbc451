"""A picture at any moment: coarse first, then ray by ray as it shall be."""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from renderers.art.regions import Gather
from renderers.art.tracer import RenderStoppedError
from renderers.scene import GBuffer, Image, Scene
from renderers.snapshots.delivery import Finisher
from renderers.snapshots.growing import Pixels, show
from renderers.snapshots.request import ImageSpec, ScopeWork, SnapshotRequest
from renderers.snapshots.saved_work import SavedWork
from renderers.snapshots.team import (
    Progress,
    Team,
    Tools,
    Traced,
    empty_gather,
    found_by,
    traced_camera,
)

Scalar = TypeVar("Scalar", bound=np.generic)

COARSER = (16, 4)
"""Rays along a side that one ray of a coarse picture stands for: .4 and 6 % of them."""


SMALLEST_PX = 8
"""Pictures smaller than this are not asked for."""


SHARE = 0.1
"""Of the time so far, that may go into shading what is then shaded again."""


FIRST_S = 0.25
"""A picture that is finished sooner is not shown in parts."""


def fill(
    found: GBuffer | Image, done: NDArray[np.bool_], coarse: GBuffer | Image
) -> GBuffer | Image:
    """Show a coarser picture of the same view where a picture is not done yet."""
    rows, columns = (
        _nearest(size, other, min(found.size), min(coarse.size))
        for size, other in zip(found.size, coarse.size, strict=True)
    )

    def mixed(fine: NDArray[Scalar], rough: NDArray[Scalar]) -> NDArray[Scalar]:
        mask = done.reshape(done.shape + (1,) * (fine.ndim - 2))
        return np.asarray(np.where(mask, fine, rough[rows[:, None], columns]))

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


def _nearest(size: int, other: int, short: int, other_short: int) -> NDArray[np.intp]:
    """Find the coarse pixel whose centre lies nearest to each fine one's.

    short: the pictures' shorter sides, which the lens's field falls on.
    """
    at = (np.arange(size) + 0.5 - size / 2) * (other_short / short) + other / 2
    nearest: NDArray[np.intp] = np.clip(np.floor(at), 0, other - 1).astype(np.intp)
    return nearest


class Preview:
    """Show coarse pictures, then what is there of the picture itself.

    None of it touches the picture: all is shaded anew when all is there.
    """

    def __init__(
        self, folder: Path, request: SnapshotRequest, scene: Scene, finisher: Finisher
    ) -> None:
        """Show nothing of a request that is not progressive.

        folder: the attempt's.
        """
        self._folder = folder
        self._request = request
        self._scene = scene
        self._finisher = finisher
        self._pixels = np.zeros((request.image.height, request.image.width, 3), "u1")
        self._coarse: GBuffer | Image | None = None
        self._gain: float | None = None
        self._rays = 0
        self._began = time.monotonic()
        self._spent_s = 0.0

    def show_coarse(self, request: SnapshotRequest, found: GBuffer | Image) -> None:
        """Show a coarse picture in place of the whole.

        request: for just that coarse picture.
        """
        if self._request.progressive:
            picture = self._finisher.finish(
                _by_quick_light(request), self._scene, Traced(found, {})
            )
            self._pixels = _enlarged(picture.pixels, self._pixels.shape)
            show(self._folder, self._pixels)
            self._coarse, self._gain = found, picture.gain

    def look(self, gather: Gather) -> None:
        """Show what is gathered when there is time for it."""
        elapsed = time.monotonic() - self._began
        is_time = elapsed > FIRST_S and self._spent_s < SHARE * elapsed
        if self._request.progressive and is_time:
            self.show_gathered(gather)

    def show_gathered(self, gather: Gather) -> None:
        """Shade one sample a pixel of what is there, unless nothing is new."""
        rays = gather.done.size - gather.missing
        if rays == self._rays:
            return
        self._rays = rays
        began = time.monotonic()
        step = 2 if self._request.image.samples == 4 else 1
        part = Gather(self._request.image.width, self._request.image.height)
        part.value = np.ascontiguousarray(gather.value[::step, ::step])
        part.depth = np.ascontiguousarray(gather.depth[::step, ::step])
        part.solids = gather.solids and gather.solids.every(step)
        single = self._single()
        found, done = found_by(single, self._scene, part), gather.done[::step, ::step]
        if self._coarse is not None:
            # else the camera's blur would draw a dark rim round each part
            found = fill(found, done, self._coarse)
        picture = self._finisher.finish(single, self._scene, Traced(found, {}))
        self._pixels[done] = picture.pixels[done]
        show(self._folder, self._pixels)
        self._spent_s += time.monotonic() - began

    def _single(self) -> SnapshotRequest:
        """Make the request of one sample a pixel, exposed as the coarse pictures were.

        A camera that metered what happens to be there would flicker.
        """
        request = _by_quick_light(self._request)
        work = request.work
        if isinstance(work, ScopeWork) and work.gain is None:
            work = msgspec.structs.replace(work, gain=self._gain)
        image = msgspec.structs.replace(request.image, samples=1)
        return msgspec.structs.replace(request, image=image, work=work)


def _enlarged(pixels: Pixels, shape: tuple[int, ...]) -> Pixels:
    """Enlarge a coarse picture smoothly."""
    from PIL import Image as PngImage

    size, filter_ = (shape[1], shape[0]), PngImage.Resampling.BILINEAR
    return np.array(PngImage.fromarray(pixels).resize(size, filter_))


def _by_quick_light(request: SnapshotRequest) -> SnapshotRequest:
    """Leave out light by paths, which takes longer than all the rest."""
    work = request.work
    if isinstance(work, ScopeWork):
        work = msgspec.structs.replace(work, path_tracing=None)
    return msgspec.structs.replace(request, work=work)


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

        def go_on(_: float, before: GBuffer | Image | None = coarse) -> bool:
            return progress(0.0) and (before is None or not enough())

        try:
            traced = team.trace(rough, scene, go_on, tools=tools)
        except RenderStoppedError as stop:
            if coarse is None or stop.partial is None or stop.done is None:
                raise
            if not enough():
                raise
            coarse = fill(stop.partial, stop.done, coarse)
            break
        cost.update(traced.counters)
        coarse = traced.found
        sides = -(-traced_camera(request).width // rough.image.width)
        if enough():
            break
        if preview:
            preview.show_coarse(rough, coarse)
    if request.progressive and coarse is None:
        enough = _never
    gather = empty_gather(request)
    if saved:
        cost["rays_kept"] = saved.restore(gather)

    def look(share: float) -> bool:
        if preview:
            preview.look(gather)
        goes_on = progress(share) and not enough()
        if saved and goes_on:
            saved.look(gather)
        return goes_on

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
    """Make requests of fewer rays, the coarsest first.

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


def _never() -> bool:
    return False
