import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer
from renderers.art.march import FrameRays
from renderers.art.quality import Quality
from renderers.art.ranks.messages import Message, MessageKind
from renderers.art.ranks.node import Node
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.prepare import MarchNode, make_node
from renderers.art.ranks.rank import Rank
from renderers.art.ranks.transport import TransportError
from renderers.art.regions import Gather, Region, deal_regions
from renderers.scene import Camera, Scene
from tests.loop_back import LoopBack

QUALITY = Quality(0.5, 1 / 1024)
KINDS = {
    "post": ("classic", QUALITY),
    "integrated": ("classic", replace(QUALITY, classification="integrated")),
    "scope": ("scope", QUALITY),
}


def draw(
    scene: Scene,
    kind: str,
    camera: Camera,
    ranks: int,
    *,
    seed: int = 0,
    side: int = 8,
    room: int | None = None,
    dataflow: Dataflow = Dataflow.MIGRATING,
    from_file: bool = False,
    frames: int = 1,
    order: Callable[[list[Region]], list[Region]] = list,
) -> tuple[list[NDArray[np.float32]], list[MarchNode]]:
    """Draw with ranks in one process, each moved in a random order.

    room: slots of a cache, beyond a rank's share of the cells where it has to keep one.
    """
    mode, quality = KINDS[kind]
    if room is not None and dataflow is Dataflow.MIGRATING and not from_file:
        full = make_node(scene, mode, quality, cell_side=side)[2].occupied
        room += -(-full // ranks)
    joint = LoopBack(ranks, seed)
    random = np.random.default_rng(seed)
    parts = [Rank(joint.end(rank)) for rank in range(ranks)]
    made = [
        make_node(
            scene,
            mode,
            quality,
            policy=CellPolicy(room, dataflow, from_file),
            rank=rank,
            ranks=ranks,
            cell_side=side,
            validate=True,
        )
        for rank in range(ranks)
    ]
    rays = FrameRays.of(camera)
    pictures = []
    for frame in range(1, frames + 1):
        gather = Gather(camera.width, camera.height)
        waiting = list(random.permutation(ranks))
        turns = 0
        while not (parts[0].is_drawing and parts[0].is_complete):
            # Ranks begin at different times, some after others have asked for cells.
            if waiting and random.random() < 0.3:
                rank = int(waiting.pop())
                march, node, _ = made[rank]
                regions = deal_regions(camera.width, camera.height, rank, ranks)
                packets = [march.start(region, rays) for region in order(regions)]
                parts[rank].begin(frame, node, packets, None if rank else gather)
            parts[int(random.integers(ranks))].step()
            turns += 1
            assert turns < 300_000, "the ranks do not finish"
        parts[0].end()
        for _ in range(300 * ranks):
            for part in parts:
                part.step()
        assert not any(part.is_drawing for part in parts)
        assert joint.in_flight == 0
        assert gather.missing == 0
        pictures.append(np.dstack([gather.value, gather.depth]))
    return pictures, [node for _, node, _ in made]


@pytest.fixture(scope="module")
def one(
    scene: Scene, outside: Camera, inside: Camera
) -> dict[str, NDArray[np.float32]]:
    """Draw each kind with a single rank, as the tracer does by itself."""
    found = {}
    for kind, (mode, quality) in KINDS.items():
        camera = inside if mode == "scope" else outside
        found[kind] = draw(scene, kind, camera, 1)[0][0]
        if mode == "classic":
            image = ActiveRayTracer(scene, quality).render(camera)
            assert image.depth_mm is not None
            alone = np.dstack([image.rgba, image.depth_mm])
            assert found[kind].tobytes() == alone.tobytes()
    return found


@settings(max_examples=40, deadline=None)
@given(
    kind=st.sampled_from(sorted(KINDS)),
    ranks=st.sampled_from([1, 2, 3, 4, 7, 16]),
    seed=st.integers(0, 2**32 - 1),
    side=st.sampled_from([8, 16, 32]),
    room=st.sampled_from([1, 2, 9, None]),
    flow=st.sampled_from(
        [
            (Dataflow.MIGRATING, False),
            (Dataflow.MIGRATING, True),
            (Dataflow.STATIC, False),
            (Dataflow.STATIC, True),
            (Dataflow.REPLICATED, False),
            (Dataflow.SHARED, False),
        ]
    ),
    order=st.sampled_from([list, lambda regions: regions[::-1]]),
)
def test_any_ranks_delivery_cells_and_cache_give_the_same_bits(
    scene: Scene,
    outside: Camera,
    inside: Camera,
    one: dict[str, NDArray[np.float32]],
    kind: str,
    flow: tuple[Dataflow, bool],
    **how: Any,
) -> None:
    """Cells that come, go and move, and rays that travel with their last samples."""
    camera = inside if kind == "scope" else outside
    dataflow, from_file = flow
    pictures, nodes = draw(
        scene, kind, camera, dataflow=dataflow, from_file=from_file, **how
    )
    assert pictures[0].tobytes() == one[kind].tobytes()
    if dataflow is Dataflow.REPLICATED:
        assert not any(node.tally()["requests"] for node in nodes)


def test_with_little_room_cells_change_their_owners(
    scene: Scene, outside: Camera, one: dict[str, NDArray[np.float32]]
) -> None:
    pictures, nodes = draw(scene, "post", outside, 3, room=6, frames=2)
    assert pictures[0].tobytes() == pictures[1].tobytes() == one["post"].tobytes()
    tallies = [node.tally() for node in nodes]
    assert sum(tally["owners_moved"] for tally in tallies) > 0
    assert sum(tally["cells_evicted"] for tally in tallies) > 0


def test_cells_are_kept_from_frame_to_frame(scene: Scene, outside: Camera) -> None:
    pictures, nodes = draw(scene, "post", outside, 2, frames=2)
    assert pictures[0].tobytes() == pictures[1].tobytes()
    # Each rank has asked at most once for each cell that is not its own.
    for node in nodes:
        assert isinstance(node, Node)
        assert 0 < node.requests <= node.cache.capacity


def complete(parts: list[Rank]) -> None:
    while not parts[0].is_complete:
        for part in parts:
            part.step()


@pytest.mark.parametrize("dataflow", Dataflow)
def test_leaving_early_leaves_nothing_behind(
    scene: Scene, outside: Camera, dataflow: Dataflow
) -> None:
    joint = LoopBack(2, seed=3)
    parts = [Rank(joint.end(rank)) for rank in range(2)]
    made = [
        make_node(
            scene,
            "classic",
            QUALITY,
            policy=CellPolicy(dataflow=dataflow),
            rank=r,
            ranks=2,
            validate=True,
        )
        for r in range(2)
    ]
    rays = FrameRays.of(outside)

    def begin(frame: int, rank: int, gather: Gather | None) -> None:
        march, node, _ = made[rank]
        regions = deal_regions(outside.width, outside.height, rank, 2)
        parts[rank].begin(frame, node, [march.start(r, rays) for r in regions], gather)

    first = Gather(outside.width, outside.height)
    begin(1, 0, first)
    begin(1, 1, None)
    for _ in range(4):
        for part in parts:
            part.step()
    left = first.missing
    assert left > 0
    parts[0].cancel()
    complete(parts)
    assert 0 < first.missing <= left
    parts[0].end()
    while parts[1].is_drawing:
        parts[1].step()
    assert joint.in_flight == 0
    assert not any(part.is_broken for part in parts)
    # The second frame must not meet what was on its way in the first.
    second = Gather(outside.width, outside.height)
    begin(2, 1, None)
    begin(2, 0, second)
    complete(parts)
    assert second.missing == 0
    assert (
        np.dstack([second.value, second.depth]).tobytes()
        == draw(scene, "post", outside, 1)[0][0].tobytes()
    )


def test_a_rank_that_cannot_take_part_is_named(scene: Scene, outside: Camera) -> None:
    joint = LoopBack(2, delay=0)
    parts = [Rank(joint.end(rank)) for rank in range(2)]
    march, node, _ = make_node(scene, "classic", QUALITY, rank=0, ranks=2)
    regions = deal_regions(outside.width, outside.height, 0, 2)
    start = functools.partial(march.start, rays=FrameRays.of(outside))
    parts[0].begin(1, node, map(start, regions), Gather(outside.width, outside.height))
    parts[1].fail(1, "its disk is full")
    with pytest.raises(TransportError, match=r"Rank 1 .* its disk is full"):
        parts[0].step()
    parts[0].end()
    parts[1].step()
    assert parts[0].is_broken
    assert parts[1].is_broken


def test_orders_reach_every_other_rank() -> None:
    joint = LoopBack(3, delay=0)
    parts = [Rank(joint.end(rank)) for rank in range(3)]
    parts[0].order(MessageKind.BEGIN, 1, b"job")
    for part in parts[1:]:
        part.step()
        assert part.orders.popleft() == Message(
            MessageKind.BEGIN, 0, part.transport.rank, 1, 0, b"job"
        )
    assert not parts[0].orders
