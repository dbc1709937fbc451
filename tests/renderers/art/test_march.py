from collections import deque
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.art.classification import classification, sums_at_nodes
from renderers.art.march import ClassicMarch, FrameRays, ScopeMarch
from renderers.art.quality import ClassificationName
from renderers.art.ranks.messages import Message, MessageKind, ProtocolError
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.prepare import make_node
from renderers.art.ranks.ray_travel import make_frame_node
from renderers.art.regions import Gather, Region, deal_regions
from renderers.scene import (
    Camera,
    Light,
    PhongMaterial,
    Scene,
    TransferFunction,
    Volume,
    four_lights,
)


def test_the_scope_needs_a_surface(scene: Scene) -> None:
    bare = Scene(scene.volume, scene.transfer_function)
    with pytest.raises(ValueError, match="no air surface"):
        ScopeMarch(bare, Quality(0.5, 0.0))


def test_too_many_samples_are_refused(scene: Scene) -> None:
    long = Volume(
        np.zeros((2, 2, 40_000), np.int16), np.array([1.0, 1, 1]), np.zeros(3)
    )
    with pytest.raises(ValueError, match="choose a larger one"):
        ClassicMarch(
            Scene(long, scene.transfer_function),
            Quality(1 / 256, 0),
            (0, 1),
        )


def test_odd_packets_are_refused(scene: Scene) -> None:
    with pytest.raises(ValueError, match="4, 8, 16, 32 or 64 rays, got 12"):
        ScopeMarch(scene, Quality(0.5, 0.0), 12)


@pytest.mark.parametrize("kind", get_args(ClassificationName))
def test_each_thing_that_is_skipped_is_counted_and_changes_no_bit(
    scene: Scene, outside: Camera, kind: ClassificationName
) -> None:
    """Gradients that light nothing, lights that give nothing, rays that end at once."""
    quality = Quality(0.5, 0.0, classification=kind)

    def drawn(
        lights: tuple[Light, ...], material: PhongMaterial, limit: float | None = None
    ) -> tuple[NDArray[np.float32], dict[str, int], int]:
        lit = replace(scene, lights=lights, material=material)
        tracer = ActiveRayTracer(lit, quality)
        ends = None
        if limit is not None:
            ends = np.full((outside.height, outside.width), limit, np.float32)
        rgba = tracer.render(outside, limit_mm=ends).rgba
        assert tracer.report is not None
        return rgba, tracer.report.counters, tracer.memory

    plain, counters, memory = drawn((), PhongMaterial(1.0, 0.0))
    # no light and full ambience: a sample has its own colour, whatever its normal;
    # so it has beside a light too dim for the last digit of 1
    dim, off = (replace(four_lights()[0], color=np.full(3, c)) for c in (1e-30, 0.0))
    shaded, shaded_counters, shaded_memory = drawn((dim,), PhongMaterial(1.0))
    assert np.array_equal(plain, shaded)
    assert counters["contributing"] == shaded_counters["contributing"] > 0
    # no gradient is made, and no brick: an int16 or float32 a voxel and a distance
    voxels = scene.volume.values.size
    assert memory <= 5.5 * voxels < shaded_memory
    assert counters["cells_fetched"] == 0 < shaded_counters["cells_fetched"]
    for unlit in (
        drawn((off,) * 3, PhongMaterial(1.0)),
        drawn(four_lights(), PhongMaterial(1.0, 0.0)),
    ):
        assert np.array_equal(unlit[0], plain)
        assert unlit[1:] == (counters, memory)
    some, some_counters, _ = drawn((*four_lights(), off), PhongMaterial())
    wanted, wanted_counters, _ = drawn(four_lights(), PhongMaterial())
    assert np.array_equal(some, wanted)
    assert some_counters == wanted_counters
    nothing, counters, _ = drawn(four_lights(), PhongMaterial(), 0.0)
    assert not nothing.any()
    assert counters["samples"] == counters["skipped"] == counters["cells_fetched"] == 0


INTEGRATED = Quality(0.5, 1 / 1024, classification="integrated")


def test_sums_add_up_over_pieces() -> None:
    """By Simpson's rule, which is exact for products of two lines; to 1e-13."""
    rng = np.random.default_rng(4)
    nodes = np.cumsum(rng.uniform(0.1, 300, 40)) - 1000
    nodes = nodes.astype(np.float32).astype(np.float64)
    transfer = TransferFunction(nodes, rng.random((40, 3)), 10 * rng.random(40))
    pairs = sums_at_nodes(classification(transfer)).astype(np.float64)
    sums = pairs.reshape(-1, 4, 2).sum(axis=-1)
    assert not sums[0].any()
    assert not sums[1].any()
    middle = (nodes[:-1] + nodes[1:]) / 2
    parts = []
    for at in (nodes[:-1], middle, nodes[1:]):
        color, kappa = transfer.evaluate(at)
        parts.append(np.column_stack([kappa, kappa[:, None] * color]))
    pieces = (parts[0] + 4 * parts[1] + parts[2]) / 6 * np.diff(nodes)[:, None]
    # the table itself is float32: six digits
    assert sums[2:] == pytest.approx(np.cumsum(pieces, axis=0), rel=1e-6)
    # the larger halves have room for exact differences
    large = pairs.reshape(-1, 4, 2)[..., 0]
    difference = large[:, None] - large[None]
    assert np.array_equal(difference, difference.astype(np.float32))


def test_equal_sums_are_equal_bit_for_bit() -> None:
    nodes = np.array([0.0, 1, 2, 3, 4, 5])
    kappa = np.array([0.3, 0.7, 0, 0, 0, 0.1])
    table = classification(
        TransferFunction(nodes, np.random.default_rng(3).random((6, 3)), kappa)
    )
    sums = sums_at_nodes(table)
    # pieces are counted from what lies before the first node
    assert sums[3].tobytes() == sums[4].tobytes() == sums[5].tobytes()


def test_rays_without_their_last_samples_are_refused(
    scene: Scene, outside: Camera
) -> None:
    march, _, work = make_node(scene, "classic", INTEGRATED)
    packet = march.start(Region(0, 0, 8, 8), FrameRays.of(outside))
    packet.front = packet.front[:0]
    with pytest.raises(ProtocolError, match="without their last samples"):
        march.run(packet, work.bricks.view, 3, 0)


def test_classification_is_one_of_two() -> None:
    wrong: Any = "both"
    with pytest.raises(ValueError, match="post or integrated, got 'both'"):
        Quality(0.5, 0.0, classification=wrong)


@pytest.mark.parametrize("ranks", [2, 3])
@pytest.mark.parametrize("dataflow", list(Dataflow))
def test_ranks_change_no_bit(
    scene: Scene, outside: Camera, dataflow: Dataflow, ranks: int
) -> None:
    """Cells that come and go, and rays that travel with their last samples."""
    policy = CellPolicy(None if dataflow is Dataflow.RAYS else 70, dataflow)
    nodes = []
    for rank in range(ranks):
        march, node, _ = make_frame_node(
            scene, "classic", INTEGRATED, policy, rank=rank, ranks=ranks
        )
        regions = deal_regions(outside.width, outside.height, rank, ranks)
        rays = FrameRays.of(outside)
        node.begin(1, [march.start(region, rays) for region in regions])
        nodes.append(node)
    gather, travelled = Gather(outside.width, outside.height), 0
    flying: deque[Message] = deque()
    while flying or any(node.is_active for node in nodes):
        for node in nodes:
            while node.is_active:
                flying += node.advance(1)
        while flying:
            message = flying.popleft()
            if message.kind is MessageKind.REGION:
                gather.add_payload(message.payload)
            else:
                travelled += 1
                flying += nodes[message.target].handle(message)
    assert gather.missing == 0
    assert (travelled > 0) == (dataflow is not Dataflow.REPLICATED)
    alone = ActiveRayTracer(scene, INTEGRATED).render(outside)
    assert alone.depth_mm is not None
    assert gather.value.tobytes() == alone.rgba.tobytes()
    assert gather.depth.tobytes() == alone.depth_mm.tobytes()
