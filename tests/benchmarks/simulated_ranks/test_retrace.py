"""Recorded ranks and simulated nodes say the same, message by message."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.simulated_ranks.rank_recording import SAY, Recording
from benchmarks.simulated_ranks.retrace import (
    Retracing,
    simulated_node,
    simulated_ray_node,
)
from benchmarks.simulated_ranks.strands import (
    FEATURES,
    StrandPacket,
    StrandWork,
    record_packet,
)
from benchmarks.simulated_ranks.trips import Begun, StrandRayNode, StrandTravel
from renderers.art.march import COUNTERS, FrameRays
from renderers.art.quality import Quality
from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.node import Node
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.prepare import make_node
from renderers.art.ranks.rank import Rank
from renderers.art.ranks.ray_travel import make_frame_node
from renderers.art.regions import Gather, deal_regions
from renderers.scene import Camera, Scene
from tests.loop_back import LoopBack

QUALITY = Quality(0.5, 1 / 1024)
FRAMES = 2

Simulated = Node[StrandPacket] | StrandRayNode
Recorded = tuple[Retracing, list[Recording], list[Simulated]]


def record(
    scene: Scene, camera: Camera, ranks: int, spare: int, dataflow: Dataflow, seed: int
) -> Recorded:
    """Draw two frames over a loop-back, and make nodes that can repeat it."""
    march, _, lone = make_node(scene, "classic", QUALITY, policy=CellPolicy(1))
    cells = -(-lone.occupied // ranks) + spare
    rays = FrameRays.of(camera)
    joint = LoopBack(ranks, seed)
    random = np.random.default_rng(seed)
    parts = [Rank(joint.end(rank)) for rank in range(ranks)]
    watched, strands = [], []
    nodes: list[Simulated] = []
    begun: Begun = {}
    regions = [
        deal_regions(camera.width, camera.height, r, ranks) for r in range(ranks)
    ]
    for rank in range(ranks):
        # From a file, for a rank on its own would look no cell up.
        policy = CellPolicy(cells, dataflow, from_file=True)
        _, node, _ = make_frame_node(
            scene, "classic", QUALITY, policy, rank=rank, ranks=ranks
        )
        watched.append(Recording(node))
        if isinstance(node, Node):
            nodes.append(simulated_node(node))
        else:
            _, owning, _ = make_node(
                scene, "classic", QUALITY, rank=rank, ranks=ranks,
                policy=CellPolicy(dataflow=dataflow),
            )  # fmt: skip
            nodes.append(simulated_ray_node(owning, begun))
        packets = [record_packet(march.start(r, rays), lone) for r in regions[rank]]
        strands.append([packets] * FRAMES)
    for frame in range(1, FRAMES + 1):
        gather = Gather(camera.width, camera.height)
        for rank in random.permutation(ranks).tolist():
            packets_ = [march.start(r, rays) for r in regions[rank]]
            parts[rank].begin(frame, watched[rank], packets_, None if rank else gather)
        turns = 0
        while not parts[0].is_complete:
            parts[int(random.integers(ranks))].step()
            turns += 1
            assert turns < 300_000, "the ranks do not finish"
        parts[0].end()
        while any(part.is_drawing for part in parts):
            for part in parts:
                part.step()
        assert gather.missing == 0
    events = [w.events() for w in watched]
    return Retracing(nodes, events, strands), watched, nodes


@settings(max_examples=5, deadline=None)
@given(
    ranks=st.sampled_from([1, 2, 3, 5]),
    spare=st.sampled_from([1, 4, 30]),
    dataflow=st.sampled_from([Dataflow.MIGRATING, Dataflow.STATIC, Dataflow.RAYS]),
    seed=st.integers(0, 2**32 - 1),
)
def test_simulated_nodes_say_what_recorded_ranks_said(
    scene: Scene,
    outside: Camera,
    ranks: int,
    spare: int,
    dataflow: Dataflow,
    seed: int,
) -> None:
    retracing, watched, nodes = record(scene, outside, ranks, spare, dataflow, seed)
    retracing.run()
    for node, real in zip(nodes, watched, strict=True):
        told = real.tally()
        names = ["cells_fetched", "cells_evicted", "requests", "owners_moved"]
        if dataflow is Dataflow.RAYS:
            names = ["rays_sent", "requests"]
        for name in names:
            assert node.tally()[name] == told[name]
        # The kernel's own counters are shared out over strands, and sum to the whole.
        work = node.work
        if isinstance(work, StrandTravel):
            work = work.strands
        assert isinstance(work, StrandWork)
        for name in COUNTERS:
            share = work.features[FEATURES.index(name)]
            assert share == pytest.approx(told[name], abs=1e-6 * max(told[name], 1))
    assert sum(retracing.sent.values()) > 0 or ranks == 1


@pytest.mark.parametrize("change", ["cell", "order", "silence"])
def test_a_recording_that_differs_is_refused(
    scene: Scene, outside: Camera, change: str
) -> None:
    retracing, _, _ = record(scene, outside, 2, 4, Dataflow.MIGRATING, 5)
    events = retracing._events[1]
    said = next(k for k, event in enumerate(events) if event[0] == SAY)
    if change == "cell":
        row = list(events[said])
        row[5] += 1
        events[said] = tuple(row)
    elif change == "order":
        del events[said - 1]
    else:
        del events[said]
    with pytest.raises(ProtocolError):
        retracing.run()
