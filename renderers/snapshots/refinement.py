"""Four samples a pixel where they matter most, one elsewhere.

A picture of one sample a pixel comes first. What that may be wrong by is estimated for
each pixel, from how its colour, normal and depth differ from its neighbours'; tiles of
pixels get their four samples in the order of their estimated squared errors. What is
refined has the bits of the whole picture, so that the end is that very picture; before,
it is the best so far, and says how far off it is: the estimate is put right all the
while by what refining has changed.
"""

import math
from collections import Counter
from collections.abc import Callable

import msgspec
import numpy as np
from numpy.typing import NDArray

from renderers.art.tracer import RenderStoppedError
from renderers.scene import GBuffer, Scene
from renderers.shading import downsample_gbuffer, downsample_radiance, meter
from renderers.snapshots.delivery import Finisher, Picture
from renderers.snapshots.error_estimate import (
    block_sums,
    eye_codes,
    in_field,
    sample_error,
    spread_blocks,
)
from renderers.snapshots.request import ImageSpec, ScopeWork, SnapshotRequest
from renderers.snapshots.team import Progress, Team, empty_gather

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

Show = Callable[[NDArray[np.uint8]], None]


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
        self._order = np.zeros(0, np.int64)
        self._done = 0
        image = ImageSpec(request.image.width, request.image.height, 1)
        single = msgspec.structs.replace(request, image=image)
        traced = team.trace(single, scene, lambda share: go_on(0.1 * share))
        assert isinstance(traced.found, GBuffer)
        self.counters.update(traced.counters)
        sight = finisher.sight(single, self._work, scene)
        self._gbuffer = sight.with_tools(traced.found)
        self._radiance = sight.shader.shade(
            self._gbuffer, sight.camera, sight.light, casters=sight.casters
        )
        self._gain = self._work.gain or meter(self._radiance, self._gbuffer.material)
        self._sight = finisher.sight(request, self._work, scene)
        self._fine = GBuffer.empty(*empty_gather(request).depth.shape)
        self._have = np.zeros(self._fine.size, np.bool_)
        self._lattice = self._sight.shader.lattice(
            self._fine.size,
            self._sight.camera,
            self._sight.light,
            self._sight.casters,
        )
        self._counted = in_field(self._gbuffer.coverage)
        code = eye_codes(self._radiance, self._gain)
        self.guess = sample_error(self._gbuffer, code, self._counted)
        height, width = self._gbuffer.size
        self._tiles_across = -(-width // TILE_PX)
        self._tiles = block_sums(self.guess**2, TILE_PX)
        self._order = np.argsort(-self._tiles.ravel(), kind="stable")
        self.refined = np.zeros((height, width), np.bool_)
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
        tiles = tiles or self.next_tiles
        chosen = self._order[self._done : self._done + tiles]
        fresh = np.zeros(
            (-(-self._gbuffer.size[0] // TILE_PX), self._tiles_across), bool
        )
        fresh.ravel()[chosen] = True
        here = spread_blocks(fresh, TILE_PX, self._gbuffer.size)
        only = spread_blocks(fresh, 2 * TILE_PX, self._fine.size)
        lights = self._sight.shader.lattice_pixels(
            self._sight.with_tools(self._fine), only
        )
        self._trace((only | lights) & ~self._have)
        seen = self._sight.with_tools(self._fine)
        radiance = downsample_radiance(
            self._sight.shader.shade(
                seen,
                self._sight.camera,
                self._sight.light,
                only=only,
                lattice=self._lattice,
            )
        )
        told = here & self._counted
        change = eye_codes(radiance[told], self._gain) - eye_codes(
            self._radiance[told], self._gain
        )
        true = float((change.astype(np.float64) ** 2).sum()) / 3
        guessed = float((self.guess[told] ** 2).sum())
        self._done += len(chosen)
        if guessed > 0:
            # what comes next is most like what came last; but the worst of all are
            # edges, whose steps are larger against what a sample gets wrong
            worst = self._done * CHUNKS <= len(self._order) + CHUNKS
            self._scale = (EDGES if worst else 1) * math.sqrt(true / guessed)
        self._radiance[here] = radiance[here]
        small = downsample_gbuffer(seen)
        for name in ("depth_mm", "normal", "coverage", "material"):
            getattr(self._gbuffer, name)[here] = getattr(small, name)[here]
        self.refined |= here

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
        for name in ("depth_mm", "normal", "coverage", "material"):
            getattr(self._fine, name)[rays] = getattr(traced.found, name)[rays]
        self._have |= rays


def refined(
    refinement: Refinement,
    go_on: Progress,
    enough: Callable[[], bool],
    show: Show | None = None,
) -> Picture:
    """Refine until the error is estimated at the request's tolerance, or it is enough.

    show: what to do with the picture of one sample a pixel. Raise RenderStoppedError
    when `go_on` says so.
    """
    if show is not None:
        show(refinement.picture().pixels)
    while not refinement.is_done:
        if not go_on(0.1 + 0.9 * refinement.share):
            raise RenderStoppedError()
        if enough():
            break
        refinement.step()
    return refinement.picture()
