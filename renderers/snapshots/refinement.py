"""What there is of a picture at any moment, and how far off that is.

Coarse pictures come first, where one is asked for at any moment; then the picture
itself, ray by ray. One that has to stop shows, where a ray is missing, the nearest one
of a coarser picture: it has steps of that one's blocks there. What varies by d from
block to block varies by as much within one, and a step is off by d / sqrt(12) (rms)
then. The parts that were traced correct this: each of their blocks is compared with
its own middle, and the estimate is scaled by the ratio.

Where a tolerance is given, a picture of one sample a pixel comes first. It is off where
colour, normal or depth differ from the neighbours'; tiles get their four samples in the
order of that estimate, squared. What is refined has the bits of the whole picture, so
that the end is that very picture; before, it is the best so far, and says how far off
it is: the estimate is put right all the while by what refining has changed.
"""

import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from renderers.art.regions import Gather
from renderers.art.tracer import RenderStoppedError
from renderers.scene import GBuffer, Image, Scene
from renderers.shading import downsample_gbuffer, downsample_radiance, meter
from renderers.snapshots.delivery import (
    Attempt,
    Finisher,
    Picture,
    added_up,
    eye_codes,
    in_field,
    path_tracing_of,
)
from renderers.snapshots.growing import Pixels, show
from renderers.snapshots.request import ImageSpec, ScopeWork, SnapshotRequest
from renderers.snapshots.team import (
    Progress,
    Team,
    Tools,
    Traced,
    empty_gather,
    found_by,
    traced_camera,
)

Plane = NDArray[np.float64]
Marks = NDArray[np.bool_]
Scalar = TypeVar("Scalar", bound=np.generic)

COARSER = (16, 4)
"""Rays along a side that one ray of a coarse picture stands for: .4 and 6 % of them."""

SMALLEST_PX = 8
"""Pictures smaller than this are not asked for."""

SHARE = 0.1
"""Of the time so far, that may go into shading what is then shaded again."""

FIRST_S = 0.25
"""A picture that is finished sooner is not shown in parts."""

LEAST_BLOCKS = 16
"""Traced blocks that a ratio is believed of."""

LARGEST_RATIO = 16.0
"""Of squared errors. Where neighbours are alike a ratio says nothing."""

FLOOR_CODES = 0.5
"""Estimate where neighbours are alike: there is detail finer than a pixel."""

NORMAL_WEIGHT, DEPTH_WEIGHT = 0.5, 0.25
"""What a step in normal or depth counts beside one in colour: an edge may cross a pixel
whose neighbours look alike."""

TILE_PX = 8
"""Edge of a tile: two of the lattice's steps for bounced light."""

CHUNKS = 8
"""Parts in which a picture is refined whole; between them it may stop."""

MARGIN = 0.9
"""Of the tolerance is aimed at."""

FIRST_SCALE, EDGES = 0.5, 2.0
"""Error of a sample over its estimate before anything was refined, and how much more it
is elsewhere than in the worst eighth. In the six nasal views, 256 x 256, .25 to .64 and
2.0 to 2.2 would have been right."""


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


def fill(
    found: GBuffer | Image, done: Marks, coarse: GBuffer | Image
) -> GBuffer | Image:
    """Show a coarser picture of the same view where a picture is not done yet."""
    rows, columns = (
        _nearest(size, other, min(found.size), min(coarse.size))
        for size, other in zip(found.size, coarse.size, strict=True)
    )
    mixed = {}
    for field in fields(found):
        fine, rough = getattr(found, field.name), getattr(coarse, field.name)
        mask = done.reshape(done.shape + (1,) * (fine.ndim - 2))
        mixed[field.name] = np.where(mask, fine, rough[rows[:, None], columns])
    return replace(found, **mixed)


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
    attempt: Attempt,
    preview: Preview | None = None,
    tools: Tools = (),
) -> Traced:
    """Trace a request; what there is when it is enough is the picture.

    There is always a picture of a progressive request: the coarsest is finished whether
    it is enough or not, and so is one that is too small for a coarser one. What an
    earlier attempt found is not traced again; those rays are counted as `rays_kept`.
    preview: shows coarse pictures, then parts of the picture, where it is progressive.
    tools: as `Team` takes them.
    Raise RenderStoppedError when the attempt may not go on, or nothing can be had.
    """
    enough, saved = attempt.enough, attempt.saved
    cost = Counter[str]()
    coarse: GBuffer | Image | None = None
    sides = 1
    for rough in coarse_requests(request):

        def go_on(_: float, before: GBuffer | Image | None = coarse) -> bool:
            return attempt.go_on(0.0) and (before is None or not enough())

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
        enough = Attempt().enough
    gather = empty_gather(request)
    if saved:
        cost["rays_kept"] = saved.restore(gather)

    def look(share: float) -> bool:
        if preview:
            preview.look(gather)
        goes_on = attempt.go_on(share) and not enough()
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


def stopped_picture(
    request: SnapshotRequest, traced: Traced, picture: Picture
) -> Picture:
    """Say of a picture that was stopped early what is missing and how far off it is."""
    if traced.drawn is None:
        return picture
    rays = added_up(request, traced.drawn)
    samples = rays
    if path_tracing_of(request) is not None:
        samples = np.where(rays > 0, picture.samples, np.uint32(0))
    counted = np.ones(rays.shape, np.bool_)
    if picture.gain is not None:
        counted = in_field(picture.coverage)
    error = stopped_error(
        eye_codes(picture.radiance[..., :3], picture.gain or 1.0),
        rays == request.image.samples,
        max(traced.coarse // (2 if request.image.samples == 4 else 1), 1),
        counted,
    )
    # of light upon coarse walls neither the noise nor the paths are worth keeping
    return replace(
        picture, complete=False, samples=samples, noise=None, state=None, error=error
    )


def stopped_error(
    codes: NDArray[np.float32], drawn: Marks, block_px: int, counted: Marks
) -> float:
    """Estimate the root mean square error of a picture, in its own units.

    codes: ``(h, w, c)`` as shown. drawn: ``(h, w)``, pixels whose rays were all traced.
    block_px: edge of the blocks that the others show. counted: ``(h, w)``, pixels that
    the mean is over.
    """
    if not (counted & ~drawn).any():
        return 0.0
    edge = min(block_px, *drawn.shape)
    exact = codes.astype(np.float64)
    pixels = block_sums(np.ones(drawn.shape), edge)
    guess = _step_errors(block_sums(exact, edge) / pixels[..., None])
    marked = block_sums((drawn & counted).astype(np.float64), edge)
    known = (pixels == edge**2) & (marked == pixels)
    ratio = 1.0
    if np.count_nonzero(known) >= LEAST_BLOCKS:
        guessed = float(guess[known].sum())
        true = float((_variation(exact, edge) / pixels)[known].sum())
        if guessed > 0:
            ratio = float(np.clip(true / guessed, 1 / LARGEST_RATIO, LARGEST_RATIO))
    missing = block_sums((~drawn & counted).astype(np.float64), edge)
    mean = (guess * missing).sum() / np.count_nonzero(counted)
    return float(np.sqrt(ratio * mean))


def _step_errors(means: Plane) -> Plane:
    """Estimate each block's mean squared error if it has one colour."""
    total = np.zeros(means.shape[:2])
    for axis in (0, 1):
        step = (np.diff(means, axis=axis) ** 2).mean(axis=-1) / 12
        # a block has two neighbours along an axis, or one at the edge
        sums, sides = np.zeros_like(total), np.zeros_like(total)
        for half in _halves(axis):
            sums[half] += step
            sides[half] += 1
        total += sums / np.maximum(sides, 1)
    return total


def _variation(exact: Plane, edge: int) -> Plane:
    """Add up each block's squared distances from its middle."""
    at = []
    for length in exact.shape[:2]:
        starts = np.arange(0, length, edge)
        middles = np.stack([starts + (edge - 1) // 2, starts + edge // 2])
        at.append(np.minimum(middles, length - 1))
    rows, columns = at
    middle = exact[rows[:, :, None, None], columns[None, None]].mean(axis=(0, 2))
    spread = spread_blocks(middle, edge, exact.shape)
    return block_sums(((exact - spread) ** 2).mean(axis=-1), edge)


def can_refine(request: SnapshotRequest) -> bool:
    """Return whether a request asks for samples in the order of what they change."""
    work = request.work
    return (
        request.tolerance is not None
        and request.image.samples == 4
        and isinstance(work, ScopeWork)
        and work.path_tracing is None
    )


class Refinement:
    """Refine one view, part by part."""

    def __init__(
        self,
        team: Team,
        finisher: Finisher,
        request: SnapshotRequest,
        scene: Scene,
        go_on: Progress,
    ) -> None:
        """Draw the picture of one sample a pixel; RenderStoppedError as `Team`."""
        assert isinstance(request.work, ScopeWork)
        self._team, self._finisher, self._scene = team, finisher, scene
        self._request, self._work, self._go_on = request, request.work, go_on
        self.counters: Counter[str] = Counter()
        self._done = 0
        image = msgspec.structs.replace(request.image, samples=1)
        single = msgspec.structs.replace(request, image=image)
        traced = team.trace(single, scene, lambda share: go_on(0.1 * share))
        assert isinstance(traced.found, GBuffer)
        self.counters.update(traced.counters)
        sight = finisher.sight(single, self._work, scene)
        self._gbuffer = sight.with_tools(traced.found)
        self._radiance = sight.shaded(self._gbuffer)
        self._gain = self._work.gain or meter(self._radiance, self._gbuffer.material)
        self._sight = sight = finisher.sight(request, self._work, scene)
        self._fine = GBuffer.empty(sight.camera.height, sight.camera.width)
        self._have = np.zeros(self._fine.size, np.bool_)
        self._lattice = sight.shader.lattice(
            self._fine.size, sight.camera, sight.light, sight.casters
        )
        self._counted = in_field(self._gbuffer.coverage)
        code = eye_codes(self._radiance, self._gain)
        self.guess = sample_error(self._gbuffer, code, self._counted)
        self._tiles = block_sums(self.guess**2, TILE_PX)
        self._order = np.argsort(-self._tiles.ravel(), kind="stable")
        self.refined = np.zeros(self._gbuffer.size, np.bool_)
        self._scale = FIRST_SCALE

    @property
    def share(self) -> float:
        """Return the share of the tiles that are refined."""
        return self._done / len(self._order)

    @property
    def error(self) -> float:
        """Return the estimated root mean square error, in codes of encoded light."""
        rest = float((self.guess[~self.refined] ** 2).sum())
        return self._scale * math.sqrt(rest / max(int(self._counted.sum()), 1))

    @property
    def is_done(self) -> bool:
        """Return whether the request is satisfied."""
        tolerance = self._request.tolerance or 0.0
        return self.share == 1 or (tolerance > 0 and self.error <= tolerance)

    @property
    def next_tiles(self) -> int:
        """Return the tiles to refine next: an eighth of all, or what is still needed.

        Where a tolerance is asked for, and the estimate has been put right by a first
        eighth, as many as it takes by that estimate, and a tenth more of the error:
        each part costs something of its own.
        """
        tolerance = self._request.tolerance or 0.0
        eighth = -(-len(self._order) // CHUNKS)
        if tolerance == 0 or self._done == 0:
            return eighth
        rest = self._tiles.ravel()[self._order[self._done :]]
        left = rest.sum() - rest.cumsum()
        most = (MARGIN * tolerance / self._scale) ** 2 * int(self._counted.sum())
        wanted = int(np.count_nonzero(left > most)) + 1
        return min(max(wanted, eighth // 2), CHUNKS // 2 * eighth)

    def step(self, tiles: int | None = None) -> None:
        """Refine the next tiles, `next_tiles` if no number is given."""
        tiles, sight = tiles or self.next_tiles, self._sight
        chosen = self._order[self._done : self._done + tiles]
        fresh = np.zeros(self._tiles.shape, np.bool_)
        fresh.ravel()[chosen] = True
        here = spread_blocks(fresh, TILE_PX, self._gbuffer.size)
        only = spread_blocks(fresh, 2 * TILE_PX, self._fine.size)
        lights = sight.shader.lattice_pixels(sight.with_tools(self._fine), only)
        self._trace((only | lights) & ~self._have)
        seen = sight.with_tools(self._fine)
        radiance = downsample_radiance(
            sight.shader.shade(
                seen, sight.camera, sight.light, only=only, lattice=self._lattice
            )
        )
        told = here & self._counted
        after, before = (
            eye_codes(light[told], self._gain) for light in (radiance, self._radiance)
        )
        change = after - before
        true = float((change.astype(np.float64) ** 2).sum()) / 3
        guessed = float((self.guess[told] ** 2).sum())
        self._done += len(chosen)
        if guessed > 0:
            # what comes next is most like what came last; but the worst of all are
            # edges, whose steps are larger against what a sample gets wrong
            worst = self._done * CHUNKS <= len(self._order) + CHUNKS
            self._scale = (EDGES if worst else 1) * math.sqrt(true / guessed)
        self._radiance[here] = radiance[here]
        _copy(downsample_gbuffer(seen), self._gbuffer, here)
        self.refined |= here

    def run(self, enough: Callable[[], bool]) -> Picture:
        """Refine until the request is satisfied, or it is enough.

        Raise RenderStoppedError when `go_on` says so.
        """
        while not self.is_done:
            if not self._go_on(0.1 + 0.9 * self.share):
                raise RenderStoppedError()
            if enough():
                break
            self.step()
        return self.picture()

    def picture(self) -> Picture:
        """Return the picture as it is now."""
        pixels, gain = self._finisher.expose(
            self._request, self._work, self._radiance, self._gbuffer
        )
        return Picture(
            pixels,
            self._radiance.copy(),
            self._gbuffer.depth_mm,
            self._gbuffer.coverage,
            np.where(self.refined, np.uint32(4), np.uint32(1)),
            gain,
            complete=self.is_done,
            error=self.error,
        )

    def _trace(self, rays: NDArray[np.bool_]) -> None:
        if not self._team.traces_parts:
            rays = ~self._have
        if not rays.any():
            return
        share = self._done / max(len(self._order), 1)

        def go_on(part: float) -> bool:
            return self._go_on(0.1 + 0.9 * (share + part / CHUNKS))

        gather = empty_gather(self._request)
        gather.wanted = rays
        traced = self._team.trace(self._request, self._scene, go_on, gather)
        self.counters.update(traced.counters)
        assert isinstance(traced.found, GBuffer)
        _copy(traced.found, self._fine, rays)
        self._have |= rays


def _copy(source: GBuffer, target: GBuffer, here: Marks) -> None:
    for field in fields(source):
        getattr(target, field.name)[here] = getattr(source, field.name)[here]


def sample_error(gbuffer: GBuffer, codes: NDArray[np.float32], counted: Marks) -> Plane:
    """Estimate each pixel's error, but for a scale, ``(h, w)`` codes.

    gbuffer, codes: of a picture of one sample a pixel. The estimate is 0 where a pixel
    is not counted.
    """
    shown = gbuffer.coverage > 0
    depth = np.log(np.where(shown, gbuffer.depth_mm, np.float32(1e3)))
    bright = codes.mean(axis=-1)
    total = np.zeros(shown.shape, np.float32)
    for axis in (0, 1):
        # light that rises evenly is right in the middle of a pixel
        bend = np.zeros_like(codes)
        rise = np.diff(codes, axis=axis) / 2
        first, last = _halves(axis)
        bend[first] -= rise
        bend[last] += rise
        total += np.einsum("ijk,ijk->ij", bend, bend) / 3
        normal = gbuffer.normal
        turn = 1 - np.einsum("ijk,ijk->ij", normal[first], normal[last])
        turn = np.clip(turn, 0, 1) * (shown[first] & shown[last])
        step = np.minimum(np.abs(np.diff(depth, axis=axis)), 1)
        edge = (NORMAL_WEIGHT * turn + DEPTH_WEIGHT * step) ** 2 / 2
        total[first] += edge * bright[first] ** 2
        total[last] += edge * bright[last] ** 2
    guess = np.sqrt(np.where(counted, total / 2 + FLOOR_CODES**2, 0))
    return np.asarray(guess, np.float64)


def block_sums(plane: Plane, edge: int) -> Plane:
    """Add up the squares of a picture, which may be cut off at its far edges."""
    for axis in (0, 1):
        starts = np.arange(0, plane.shape[axis], edge)
        plane = np.asarray(np.add.reduceat(plane, starts, axis=axis))
    return plane


def spread_blocks(
    blocks: NDArray[Scalar], edge: int, size: tuple[int, ...]
) -> NDArray[Scalar]:
    """Return the value of each pixel's block."""
    whole = np.repeat(np.repeat(blocks, edge, axis=0), edge, axis=1)
    return np.ascontiguousarray(whole[: size[0], : size[1]])


def _halves(axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return all but the last, and all but the first, along one of two axes."""
    before, after = [slice(None)] * 2, [slice(None)] * 2
    before[axis], after[axis] = slice(None, -1), slice(1, None)
    return tuple(before), tuple(after)
