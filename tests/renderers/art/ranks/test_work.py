import numpy as np
import pytest

from renderers.art import ActiveRayTracer
from renderers.art.march import FrameRays
from renderers.art.quality import Quality
from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.prepare import make_node
from renderers.art.ranks.work import MarchWork
from renderers.art.regions import Gather, deal_regions
from renderers.scene import Camera, Scene
from renderers.scene.deflection import Deflection, Translation


def make(scene: Scene, dataflow: Dataflow) -> MarchWork:
    quality = Quality(0.5, 0.0)
    policy = CellPolicy(dataflow=dataflow)
    return make_node(scene, "classic", quality, ranks=2, policy=policy)[2]


def test_a_cell_of_the_wrong_size_is_refused(scene: Scene) -> None:
    with pytest.raises(ProtocolError, match="cell 3 came damaged"):
        make(scene, Dataflow.STATIC).fill(3, 0, b"12345")


def test_what_is_delivered_is_what_messages_carry(
    scene: Scene, outside: Camera
) -> None:
    """Also where packets are added one by one, each when the one before is through."""
    quality = Quality(0.5, 0.01, renormalise=True)
    rays = FrameRays.of(outside)
    regions = deal_regions(outside.width, outside.height, 0, 1, 16)
    pictures = []
    for delivers in (False, True):
        march, node, work = make_node(scene, "classic", quality)
        gather = Gather(outside.width, outside.height)
        work.deliver(gather if delivers else None)
        node.begin(1, ())
        for region in regions:
            node.add([march.start(region, rays)])
            while not node.is_finished:
                for message in node.advance(1):
                    assert bool(message.payload) != delivers
                    if not delivers:
                        gather.add_payload(message.payload)
        assert gather.missing == 0
        pictures.append((gather.value.tobytes(), gather.depth.tobytes()))
    assert pictures[0] == pictures[1]
    assert np.ptp(gather.value) > 0.1


@pytest.mark.parametrize("mode", ["classic", "scope", "bent"])
def test_rays_that_end_early_are_counted(
    scene: Scene, outside: Camera, inside: Camera, mode: str
) -> None:
    """The same number for any threads and cells."""
    counts = set()
    deflection = Deflection(())
    if mode == "bent":
        center = scene.volume.center_mm
        deflection = Deflection((Translation(center, 6.0, np.array([1.0, 0, 0])),))
    for threads, side in ((1, 8), (2, 16)):
        tracer = ActiveRayTracer(
            scene, Quality(0.5, 0.01), threads=threads, cell_side=side,
            deflection=deflection,
        )  # fmt: skip
        if mode == "scope":
            seen = tracer.gbuffer(inside).depth_mm < np.inf
        else:
            seen = 1 - tracer.render(outside).rgba[..., 3] < np.float32(0.01)
        assert tracer.report is not None
        assert tracer.report.counters["ended_early"] == np.count_nonzero(seen)
        counts.add(tracer.report.counters["ended_early"])
    assert len(counts) == 1
    assert 0 < counts.pop() < seen.size
    whole = ActiveRayTracer(scene, Quality(0.5, 0.0))
    whole.render(outside)
    assert whole.report is not None
    assert whole.report.counters["ended_early"] == 0
