"""The Active Ray Tracer on one machine: a scene and a camera become a picture."""

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from renderers.art.blocks import RAYS_A_BLOCK, Blocks
from renderers.art.cells.cell_size import SMALLEST_SIDE
from renderers.art.crew import Crew
from renderers.art.job_steps import Step, reached
from renderers.art.kernels.unpack_surface import unpack_surface
from renderers.art.march import Drawer, FrameRays, March
from renderers.art.quality import Quality
from renderers.art.ranks.prepare import LONE, Box, MarchNode, edit_node, make_node
from renderers.art.ranks.work import MarchWork
from renderers.art.regions import Gather, strips
from renderers.scene import (
    Camera,
    Change,
    ChangeKind,
    GBuffer,
    Image,
    Scene,
    Volume,
)
from renderers.scene.composition import before_solids
from renderers.scene.deflection import Deflection
from renderers.scene.thread_pool import ThreadPool

RAYS_A_SLICE = 65536
"""Rays in packets run between two looks at the progress, at most: 6 MB."""

SLICE_S = 0.04
"""Time between two looks that is aimed at: whoever cancels does not wait for longer."""

FINE_STEP = 0.25
FEWEST_RAYS = 256
MOST_RAYS = 16384
"""Nothing can interrupt a packet. One of 8192 rays took up
to .002 s at steps of 1/4 voxel; at 1/32 one of 4096 took up to .08 s, one of 256 up to
.008 (phantom at .5 mm, a view from inside, one thread). Small ones cost: with 256 rays
in place of 1,448, at 1/13 voxel, a picture took 1.1 to 1.4 times as long, and on two
threads 1.3 to 2.1 times."""

FIRST_BLOCKS = 2
"""Blocks a thread draws before anything is known of how long one takes."""

FASTER = 8
"""Times as many blocks as before, at most."""


class RenderStoppedError(RuntimeError):
    """The picture was given up because the caller wished it.

    partial: what had been found by then, if anything could be. done: ``(h, w)``, the
    pixels of it that are as they would have been in the end.
    """

    def __init__(
        self,
        partial: GBuffer | Image | None = None,
        done: NDArray[np.bool_] | None = None,
    ) -> None:
        super().__init__("the picture was given up")
        self.partial = partial
        self.done = done


@dataclass(frozen=True, slots=True)
class RenderReport:
    """What a picture cost.

    counters: samples, contributing, skipped, ended_early (rays of which no light was
    left, or that met the surface sought), cells_fetched, cells_evicted, cells_occupied,
    cells, requests. step_voxels: of the steps taken.
    """

    seconds: float
    counters: dict[str, int]
    step_voxels: float


class ActiveRayTracer:
    """Cast rays front to back through cells; implements `renderers.scene.Renderer`.

    Cells are turned into bricks when the first ray needs them and stay for the next
    picture. The picture depends neither on `threads` nor on `cell_side` nor on
    `cache_cells`, bit for bit.
    """

    def __init__(
        self,
        scene: Scene,
        quality: Quality | str = "snapshot",
        *,
        threads: int = 2,
        cell_side: int | None = None,
        cache_cells: int | None = None,
        validate: bool = False,
        packet: int | None = None,
        deflection: Deflection | None = None,
        memory_bytes: int | None = None,
    ) -> None:
        """Take a scene.

        quality: a `Quality` or the name of one. cell_side: voxels along a cell; None
        for what is quick and keeps a lit volume's copy small. cache_cells: cells kept
        ready, at least 1; None for all that can be seen and there is room for.
        memory_bytes: that may be taken beside the volume; None for half of the
        machine's. Cells there is no room for are made anew each time they are met; a
        volume of which not even a few fit is refused (ValueError) when it is drawn.
        packet: rays that march together, 4, 8, 16, 32 or 64, which makes no difference
        to the picture; None for the fastest way. deflection: bends the rays: the scene
        is seen deformed.
        """
        if threads < 1:
            raise ValueError(f"threads must be at least 1, got {threads}")
        self.scene = scene
        self.quality = (
            quality if isinstance(quality, Quality) else Quality.named(quality)
        )
        self.report: RenderReport | None = None
        self._pool = ThreadPool(min(threads, 4 * (os.cpu_count() or 1)))
        self._cell_side = cell_side
        self._cache_cells = cache_cells
        self._validate = validate
        self._packet = packet
        self._deflection = deflection
        self._memory_bytes = memory_bytes
        self._made: dict[str, tuple[March, MarchNode, MarchWork]] = {}
        self._pace = FIRST_BLOCKS * self._pool.threads

    def render(
        self,
        camera: Camera,
        progress: Callable[[float], bool] | None = None,
        gather: Gather | None = None,
        *,
        limit_mm: NDArray[np.float32] | None = None,
    ) -> Image:
        """Draw mode `classic`.

        progress: called with the share done; when it returns False the picture is
        given up with `RenderStoppedError`. The depth is where opacity passes one half.
        gather: for those who want to look at what has come so far; what is done in it
        already is not traced again.
        limit_mm: where rays end, ``(h, w)``, +inf where nothing stops them: what lies
        before an opaque thing, to its surface exactly.
        """
        gather, stopped = self._trace("classic", camera, limit_mm, progress, gather)
        image = classic_image(gather)
        if stopped:
            raise RenderStoppedError(image, gather.done)
        return image

    def gbuffer(
        self,
        camera: Camera,
        progress: Callable[[float], bool] | None = None,
        gather: Gather | None = None,
        *,
        limit_mm: NDArray[np.float32] | None = None,
    ) -> GBuffer:
        """Find the air surface behind each pixel (mode `scope`); as `render`."""
        gather, stopped = self._trace("scope", camera, limit_mm, progress, gather)
        volume = self._made["scope"][0].volume
        found = scope_gbuffer(gather, volume, self._pool)
        if stopped:
            raise RenderStoppedError(found, gather.done)
        return found

    def update(self, change: Change) -> None:
        """Follow an edit of the scene's arrays in place; see `Change`.

        Later pictures are, to the bit, those of a tracer that was made then.
        """
        if change.kind not in (ChangeKind.FILM, ChangeKind.TINT):
            self._edit((change.low, change.high))

    def replace(self, scene: Scene) -> None:
        """Go on with a scene that is the same but for the values of its volumes."""
        self.scene = scene
        self._edit(None)

    def _edit(self, box: Box | None) -> None:
        for mode, (_, node, work) in list(self._made.items()):
            march = edit_node(node, work, self.scene, box)
            if march is None:
                # made anew when it is next drawn
                del self._made[mode]
            else:
                self._made[mode] = march, node, work

    @property
    def memory(self) -> int:
        """Return the bytes kept to draw with, for all modes drawn so far."""
        return sum(work.bricks.bytes for _, _, work in self._made.values())

    def _trace(
        self,
        mode: str,
        camera: Camera,
        limit_mm: NDArray[np.float32] | None,
        progress: Callable[[float], bool] | None,
        gather: Gather | None,
    ) -> tuple[Gather, bool]:
        """Gather the rays; tell whether the caller wished to stop."""
        began = time.perf_counter()
        # whoever helps is awake then, when there is something to draw
        future = self._pool.start(partial(FrameRays.of, camera, limit_mm))
        march, node, work = self._node(mode)
        is_ours = gather is None
        if gather is None:
            gather = Gather(camera.width, camera.height, filled=False)
        rays = future.result()
        before = node.tally()
        work.deliver(gather)
        node.begin(node.frame + 1, ())
        reached(Step.FRAME_BEGUN)
        drawer = march.drawer
        if drawer and not node.stamps:
            looks = self._draw(drawer, rays, gather, node, work)
        else:
            looks = self._move(rays, gather, node, work, rays_a_packet(march.quality))
        stopped = False
        for _ in looks:
            reached(Step.RAYS_MOVED)
            share = 1 - gather.missing / gather.done.size
            stopped = progress is not None and not progress(share)
            if stopped:
                node.cancel()
                break
        work.deliver(None)
        if is_ours:
            gather.fill()
        reached(Step.RANK_DONE)
        after = node.tally()
        counters = {key: after[key] - before[key] for key in after}
        counters["cells_occupied"] = work.occupied
        counters["cells"] = work.bricks.grid.cells
        self.report = RenderReport(
            time.perf_counter() - began, counters, march.quality.step_voxels
        )
        return gather, stopped

    def _draw(
        self,
        drawer: Drawer,
        rays: FrameRays,
        gather: Gather,
        node: MarchNode,
        work: MarchWork,
    ) -> Iterator[None]:
        """Draw blocks at once, and move on what waited for cells; rest for a look."""
        left = ~gather.done if gather.missing < gather.done.size else None
        # where no ray is wanted nothing need be set up
        wanted = rays.limit > 0 if rays.is_limited else None
        blocks = Blocks.of(gather.done.shape, left, wanted)
        packets = threads = self._pool.threads
        while blocks.left or not node.is_finished:
            looked, many = time.perf_counter(), blocks.left
            if node.is_active:
                node.advance(packets)
                spent_s = time.perf_counter() - looked
                packets = next_slice(packets, spent_s, threads, RAYS_A_BLOCK)
            else:
                blocks.allow(self._pace)
                node.add(work.draw(drawer, blocks, rays, range(threads)))
                if not node.is_active:
                    many, spent_s = many - blocks.left, time.perf_counter() - looked
                    self._pace = next_blocks(many, spent_s, threads)
            yield

    def _move(
        self,
        rays: FrameRays,
        gather: Gather,
        node: MarchNode,
        work: MarchWork,
        together: int,
    ) -> Iterator[None]:
        """Move packets of so many rays; rest for a look."""
        regions = strips(gather.done, together)
        regions = [r for r in regions if np.any(rays.limit[r.rows, r.columns] > 0)]
        packets = self._pool.threads
        while regions or not node.is_finished:
            looked = time.perf_counter()
            # Rays are made when they are about to move: all of them would fill
            # the caches.
            wanted = 0 if node.is_active else packets
            fresh, regions = regions[:wanted], regions[wanted:]
            node.add(work.start(fresh, rays))
            node.advance(packets)
            spent_s = time.perf_counter() - looked
            packets = next_slice(packets, spent_s, self._pool.threads, together)
            yield

    def _side(self, mode: str) -> int | None:
        if self._cell_side is None and (mode == "scope" or self._cache_cells):
            return SMALLEST_SIDE
        return self._cell_side

    def _node(self, mode: str) -> tuple[March, MarchNode, MarchWork]:
        if mode not in self._made:
            self._made[mode] = make_node(
                self.scene,
                mode,
                self.quality,
                cell_side=self._side(mode),
                policy=replace(
                    LONE,
                    cache_cells=self._cache_cells,
                    memory_bytes=self._memory_bytes,
                ),
                validate=self._validate,
                packet=self._packet,
                deflection=self._deflection,
                crew=Crew(self._pool.map),
            )
        return self._made[mode]


def classic_image(gather: Gather) -> Image:
    """Turn gathered rays of mode `classic` into an image."""
    return Image(gather.value, gather.depth)


def scope_gbuffer(
    gather: Gather, volume: Volume, pool: ThreadPool | None = None
) -> GBuffer:
    """Turn gathered rays of mode `scope` into a G-buffer, normals to the world.

    volume: whose axes the normals were found along. pool: whose threads share the work.
    """
    shape = height, _ = gather.depth.shape
    axes = np.ascontiguousarray(volume.direction, np.float64)
    is_turned = not np.array_equal(axes, np.eye(3))
    normal = np.empty((*shape, 3), np.float32)
    coverage = np.empty(shape, np.float32)
    pool = pool or ThreadPool(1)

    def part(number: int) -> None:
        first, end = (height * k // pool.threads for k in (number, number + 1))
        rows = slice(first, end)
        unpack_surface(
            gather.value[rows], axes, is_turned, normal[rows], coverage[rows]
        )

    pool.map(part, range(pool.threads))
    return GBuffer(gather.depth, normal, coverage, np.zeros(shape, np.uint8))


def render_among(tracer: ActiveRayTracer, camera: Camera, solids: GBuffer) -> Image:
    """Draw mode `classic` with opaque solids in it: linear RGBA and depth.

    solids: what the camera sees of them alone, as `Mesh.gbuffer` gives it. Rays end at
    a solid exactly, and what lies before it covers it by what it absorbs. The depth is
    the nearer of the solid's and the one where opacity passes one half. Raises
    ValueError where the buffer does not fit the camera.
    """
    image = tracer.render(camera, limit_mm=solids.depth_mm)
    return before_solids(image, tracer.scene, camera, solids)


def rays_a_packet(quality: Quality) -> int:
    """Choose how many rays move together, where one process draws all of them."""
    fine = min(quality.step_voxels / FINE_STEP, 1.0)
    return max(int(MOST_RAYS * fine**2), FEWEST_RAYS)


def next_slice(packets: int, spent_s: float, threads: int, rays: int) -> int:
    """Choose how many packets to run before the next look, after so many took so long.

    rays: of a packet. All threads get one; the picture does not depend on it.
    """
    if spent_s > SLICE_S:
        packets //= 2
    elif spent_s < SLICE_S / 4:
        packets *= 2
    return max(min(packets, RAYS_A_SLICE // rays), threads)


def next_blocks(blocks: int, spent_s: float, threads: int) -> int:
    """Choose how many blocks to draw at once before the next look; as `next_slice`."""
    wanted = SLICE_S * blocks / max(spent_s, 1e-9)
    return int(max(min(wanted, FASTER * blocks), threads))
