"""Those who trace a snapshot together: threads of one process, or ranks."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from renderers.art.cells.cell_size import SMALLEST_SIDE, sent_side
from renderers.art.crew import ALONE, Crew
from renderers.art.job_steps import Step, reached
from renderers.art.march import FrameRays, March
from renderers.art.ranks.messages import MessageKind
from renderers.art.ranks.picture_room import PictureRoom, Turns
from renderers.art.ranks.policy import CellPolicy
from renderers.art.ranks.prepare import MarchNode, edit_node, make_node
from renderers.art.ranks.rank import FrameNode, Rank
from renderers.art.ranks.rays import RayPacket
from renderers.art.ranks.transport import RankRefusedError, Transport
from renderers.art.ranks.work import MarchWork
from renderers.art.regions import (
    Gather,
    deal_regions,
    finished_squares,
    region_edge,
)
from renderers.art.tracer import (
    ActiveRayTracer,
    RenderStoppedError,
    classic_image,
    scope_gbuffer,
)
from renderers.scene import Camera, GBuffer, Image, Scene
from renderers.scene.composition import before_solids, solids_seen
from renderers.scene.mesh import PlacedMesh
from renderers.snapshots.data_store import DataStore
from renderers.snapshots.request import (
    ClassicWork,
    ScopeWork,
    SnapshotRequest,
    decode_request,
    to_deflection,
)
from renderers.snapshots.scene_loader import (
    family_key,
    load_scene,
    load_tools,
    scene_key,
)

Tools = Sequence[PlacedMesh]


@dataclass(frozen=True, slots=True)
class Traced:
    """What tracing found: a G-buffer in mode scope, an image in mode classic.

    The image has the request's instruments in it; they join the G-buffer later.
    drawn: ``(h, w)``, the rays that were traced; None for all. The others show what a
    coarser picture has there, each of whose rays stands for `coarse` along a side.
    step_voxels: of the steps taken; None where not all was traced.
    """

    found: GBuffer | Image
    counters: dict[str, int]
    drawn: NDArray[np.bool_] | None = None
    step_voxels: float | None = None
    coarse: int = 1


def traced_camera(request: SnapshotRequest) -> Camera:
    """Return the camera that is traced: 2 x 2 rays a pixel for 4 samples."""
    camera = request.to_camera()
    factor = 2 if request.image.samples == 4 else 1
    return camera.with_size(camera.width * factor, camera.height * factor)


def empty_gather(request: SnapshotRequest) -> Gather:
    """Make what a request's rays are gathered in."""
    camera = traced_camera(request)
    return Gather(camera.width, camera.height)


def ending_rays(request: SnapshotRequest, tools: Tools) -> GBuffer | None:
    """Draw what a request's rays end at: its instruments in mode classic.

    None where there are none, and in mode scope, whose rays end at the tissue. tools:
    the request's, as `load_tools` gives them; ValueError for others, so that nobody
    draws a picture without them.
    """
    work = request.work
    wanted = work.instruments if isinstance(work, ClassicWork) else ()
    if len(tools) != len(wanted):
        raise ValueError(
            f"the request places {len(wanted)} instruments that rays end at, and "
            f"{len(tools)} were loaded"
        )
    return solids_seen(traced_camera(request), tools) if wanted else None


def found_by(request: SnapshotRequest, scene: Scene, gather: Gather) -> GBuffer | Image:
    """Read gathered rays: a G-buffer in mode scope, an image in mode classic."""
    if isinstance(request.work, ScopeWork):
        assert scene.surface is not None
        return scope_gbuffer(gather, scene.surface.distance)
    return among_solids(classic_image(gather), request, scene, gather.solids)


def among_solids(
    image: Image, request: SnapshotRequest, scene: Scene, solids: GBuffer | None
) -> Image:
    """Put what rays ended at behind what they found before it."""
    if solids is None:
        return image
    return before_solids(image, scene, traced_camera(request), solids)


Progress = Callable[[float], bool]
"""Told the share done; answers whether to go on."""


_LOOK_S = 0.02
"""Time between two looks at the progress, which may read the disk."""


@dataclass(frozen=True, slots=True)
class _KeptTracer:
    scene: bytes
    family: bytes
    tracer: ActiveRayTracer


class SerialTeam:
    """Trace with the threads of this process.

    traces_parts: whether `Gather.wanted` saves anything; ranks trace all rays.
    """

    ranks = 1
    traces_parts = True

    def __init__(self, threads: int = 2) -> None:
        self._threads = threads
        self._kept: _KeptTracer | None = None

    def trace(
        self,
        request: SnapshotRequest,
        scene: Scene,
        progress: Progress,
        gather: Gather | None = None,
        tools: Tools = (),
    ) -> Traced:
        """Trace a request; raise RenderStoppedError when `progress` says so.

        gather: one of `empty_gather`, for those who look at what has come; what is done
        in it already is not traced again. tools: of `load_tools`.
        The tracer is kept for the next request of the same scene, or follows where only
        the volume's values are others: after an edit, and back.
        """
        key, family = scene_key(request), family_key(request)
        if self._kept is None or self._kept.family != family:
            tracer = ActiveRayTracer(
                scene,
                request.to_quality(),
                threads=self._threads,
                deflection=to_deflection(request.deflectors),
            )
            self._kept = _KeptTracer(key, family, tracer)
        elif self._kept.scene != key:
            kept, self._kept = self._kept, None
            kept.tracer.replace(scene)
            self._kept = replace(kept, scene=key)
        tracer = self._kept.tracer
        camera = traced_camera(request)
        solids = ending_rays(request, tools)
        limit = None if solids is None else solids.depth_mm
        if gather is not None:
            gather.solids = solids
            if gather.wanted is not None:
                ends = np.float32(np.inf) if limit is None else limit
                limit = np.where(gather.wanted, ends, np.float32(0))
        found: GBuffer | Image
        try:
            if isinstance(request.work, ScopeWork):
                found = tracer.gbuffer(camera, progress, gather, limit_mm=limit)
            else:
                found = tracer.render(camera, progress, gather, limit_mm=limit)
                found = among_solids(found, request, scene, solids)
        except RenderStoppedError as stop:
            if isinstance(stop.partial, Image):
                stop.partial = among_solids(stop.partial, request, scene, solids)
            raise
        assert tracer.report is not None
        report = tracer.report
        return Traced(found, report.counters, step_voxels=report.step_voxels)

    def dismiss(self) -> None:
        """Forget the last scene."""
        self._kept = None


@dataclass(frozen=True, slots=True)
class _PreparedScene:
    scene: bytes
    family: bytes
    march: March
    node: MarchNode
    work: MarchWork


def mode_of(request: SnapshotRequest) -> str:
    """Return the tracer's name of a request's mode."""
    return "scope" if isinstance(request.work, ScopeWork) else "classic"


class _Prepared:
    """Keep one rank's node for the next request of the same scene, or edit it."""

    def __init__(
        self, transport: Transport, policy: CellPolicy | None, crew: Crew
    ) -> None:
        self._transport = transport
        self._policy = policy or CellPolicy()
        self._crew = crew
        self._kept: _PreparedScene | None = None
        self._room = PictureRoom(crew)

    def refuse(self) -> None:
        """Tell the others, who call `node`, that they prepare nothing together."""
        self._crew.agree(False)

    def node(self, request: SnapshotRequest, scene: Scene) -> tuple[March, FrameNode]:
        """Return what draws a request; RankRefusedError where another rank refuses."""
        if not self._crew.agree(True):
            raise RankRefusedError("Another rank cannot load the scene.")
        kept, march = self._kept, None
        key, family = scene_key(request), family_key(request)
        if kept is not None and kept.scene == key:
            return kept.march, kept.node
        if (
            kept is not None
            and kept.family == family
            # each would bring up to date what is everybody's
            and not self._crew.is_shared
        ):
            march = edit_node(kept.node, kept.work, scene)
        if kept is not None and march is not None:
            kept = replace(kept, scene=key, march=march)
        else:
            mode = mode_of(request)
            march, node, work = make_node(
                scene,
                mode,
                request.to_quality(),
                policy=self._policy,
                rank=self._transport.rank,
                ranks=self._transport.ranks,
                distances=self._transport.distances,
                deflection=to_deflection(request.deflectors),
                cell_side=self._side(mode),
                crew=self._crew,
            )
            kept = _PreparedScene(key, family, march, node, work)
        self._kept = kept
        return kept.march, kept.node

    def begin(self, gather: Gather) -> bool:
        """Begin a picture where all draw it, if there is room; before they are told."""
        fits = self._room.fits(gather)
        if fits and self._transport.rank == 0:
            self._room.begin(gather)
        return fits

    def deliver(self, gather: Gather, *, is_begun: bool) -> None:
        """Let finished rays go straight into a picture where they can.

        is_begun: see `begin`; else all together.
        """
        assert self._kept is not None
        here: Gather | None = gather
        if self._crew.is_shared:
            if not is_begun:
                self._room.make(gather)
            self._room.enter(gather)
        elif self._transport.rank > 0:
            here = None
        self._kept.work.deliver(here)

    def turns(self, rays: FrameRays, finished: NDArray[np.bool_]) -> Turns | None:
        """Return what shares out a picture's blocks; None where it is dealt by regions.

        finished: of `finished_squares`.
        """
        kept = self._kept
        assert kept is not None
        drawer = kept.march.drawer
        # where cells may have to go it has to be known which are used
        if not self._crew.is_shared or drawer is None or kept.node.stamps:
            return None
        height, width = rays.limit.shape
        edge = np.ones((region_edge(self._transport.ranks),) * 2, np.bool_)
        done = np.kron(finished, edge)[:height, :width] if finished.any() else None
        return self._room.turns(self._transport.rank, drawer, kept.work, rays, done)

    def take_back(self, gather: Gather) -> None:
        """Have the picture for oneself again; rank 0."""
        self._room.leave(gather)

    def _side(self, mode: str) -> int | None:
        """Choose cells; a number of cells that was asked for is one of small ones."""
        if mode == "scope" or self._policy.cache_cells is not None:
            return SMALLEST_SIDE
        if self._crew.is_shared:
            return None
        return sent_side(self._policy.memory_bytes)

    def kept_cells(self) -> dict[str, int]:
        """Return how many cells this rank may keep, and the bytes of their bricks."""
        assert self._kept is not None
        cells = self._kept.node.cache.capacity
        brick = self._kept.work.bricks.brick_bytes
        return {"cache_cells": cells, "cache_bytes": cells * brick}

    def forget(self) -> None:
        self._kept = None
        # a rank that was late for a frame's end may still write to it
        self._room = PictureRoom(self._crew)


class _Order(msgspec.Struct):
    """What the other ranks shall draw. finished: bits of `finished_squares`."""

    request: msgspec.Raw
    finished: bytes

    def squares(self, size: tuple[int, ...], ranks: int) -> NDArray[np.bool_]:
        """Unpack the regions that nobody need draw; ValueError for too few bits."""
        edge = region_edge(ranks)
        rows, columns = (-(-side // edge) for side in size)
        bits = np.unpackbits(np.frombuffer(self.finished, np.uint8))
        return bits[: rows * columns].reshape(rows, columns) > 0


class RankTeam:
    """Trace with all ranks of a transport; lives on rank 0."""

    traces_parts = False

    def __init__(
        self, rank: Rank, policy: CellPolicy | None = None, crew: Crew = ALONE
    ) -> None:
        self.ranks = rank.transport.ranks
        self._rank = rank
        self._crew = crew
        self._prepared = _Prepared(rank.transport, policy, crew)

    def trace(
        self,
        request: SnapshotRequest,
        scene: Scene,
        progress: Progress,
        gather: Gather | None = None,
        tools: Tools = (),
    ) -> Traced:
        """Trace as a `SerialTeam`; other ranks load what they need themselves."""
        rank = self._rank
        frame = rank.frame + 1
        gather = gather or empty_gather(request)
        gather.solids = ending_rays(request, tools)
        finished = finished_squares(gather.done, region_edge(self.ranks))
        order = _Order(
            msgspec.Raw(msgspec.json.encode(request)), np.packbits(finished).tobytes()
        )
        begun = self._prepared.begin(gather)
        rank.order(MessageKind.BEGIN, frame, msgspec.json.encode(order))
        try:
            march, node = self._prepared.node(request, scene)
            reached(Step.SCENE_LOADED)
            rays = _rays(request, gather.solids)
            self._prepared.deliver(gather, is_begun=begun)
            turns = self._prepared.turns(rays, finished)
            packets = []
            if turns is None:
                packets = _packets(march, rays, 0, self.ranks, finished)
            rank.begin(frame, node, packets, gather, turns)
            stopped = self._complete(gather, progress)
            reached(Step.FRAME_COMPLETE)
        finally:
            # Frame numbers are never used again, also when this one never began.
            rank.frame = frame
            rank.end()
            self._prepared.take_back(gather)
            if rank.is_broken:
                self._prepared.forget()
        found = found_by(request, scene, gather)
        if stopped:
            raise RenderStoppedError(found, gather.done)
        step = march.quality.step_voxels
        kept = self._prepared.kept_cells()
        counters = dict(rank.cost) | kept | {"shared_memory": int(self._crew.is_shared)}
        return Traced(found, counters, step_voxels=step)

    def dismiss(self) -> None:
        """Send the other ranks home."""
        self._rank.order(MessageKind.STOP, self._rank.frame + 1)

    def _complete(self, gather: Gather, progress: Progress) -> bool:
        """Draw until every rank is done; tell whether the picture was given up."""
        looked = time.monotonic()
        stopped = False
        while not self._rank.is_complete:
            if not self._rank.step():
                self._rank.rest()
            if not stopped and time.monotonic() - looked > _LOOK_S:
                looked = time.monotonic()
                gather.count()
                if not progress(1 - gather.missing / gather.done.size):
                    stopped = True
                    self._rank.cancel()
        return stopped


Team = SerialTeam | RankTeam
"""Those whom a worker may have trace."""


def follow(
    rank: Rank, data: DataStore, policy: CellPolicy | None = None, crew: Crew = ALONE
) -> None:
    """Trace what rank 0 orders until it sends STOP; the loop of the other ranks."""
    transport = rank.transport
    prepared = _Prepared(transport, policy, crew)
    while True:
        if not rank.step():
            rank.rest()
        if not rank.orders or rank.is_drawing:
            continue
        order = rank.orders.popleft()
        if order.kind is MessageKind.STOP:
            return
        if rank.is_broken:
            prepared.forget()
        scene = None
        try:
            told = msgspec.json.decode(order.payload, type=_Order)
            request = decode_request(bytes(told.request))
            rays = _rays(request, ending_rays(request, load_tools(data, request)))
            finished = told.squares(rays.limit.shape, transport.ranks)
            scene = load_scene(data, request)
            march, node = prepared.node(request, scene)
            gather = empty_gather(request)
            prepared.deliver(gather, is_begun=prepared.begin(gather))
            reached(Step.SCENE_LOADED)
        except (ValueError, OSError, RankRefusedError) as error:
            if scene is None:
                prepared.refuse()
            prepared.forget()
            rank.fail(order.frame, str(error))
            continue
        turns, packets = prepared.turns(rays, finished), []
        if turns is None:
            packets = _packets(march, rays, transport.rank, transport.ranks, finished)
        rank.begin(order.frame, node, packets, turns=turns)


def _rays(request: SnapshotRequest, solids: GBuffer | None) -> FrameRays:
    limit = None if solids is None else solids.depth_mm
    return FrameRays.of(traced_camera(request), limit)


def _packets(
    march: March,
    rays: FrameRays,
    rank: int,
    ranks: int,
    finished: NDArray[np.bool_],
) -> list[RayPacket]:
    height, width = rays.limit.shape
    regions = deal_regions(width, height, rank, ranks, finished=finished)
    return [march.start(region, rays) for region in regions]
