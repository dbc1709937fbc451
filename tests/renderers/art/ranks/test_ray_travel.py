"""Rays that travel and come home."""

import numpy as np
import pytest

from renderers.art.march import FrameRays
from renderers.art.quality import Quality
from renderers.art.ranks.messages import Message, MessageKind, ProtocolError
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.ray_node import RayNode
from renderers.art.ranks.ray_travel import MarchRayNode, make_frame_node
from renderers.art.regions import deal_regions
from renderers.scene import Camera, Scene

QUALITY = Quality(0.5, 1 / 1024)


def begun(scene: Scene, camera: Camera, rank: int) -> MarchRayNode:
    policy = CellPolicy(dataflow=Dataflow.RAYS)
    march, node, _ = make_frame_node(
        scene, "classic", QUALITY, policy, rank=rank, ranks=2
    )
    assert isinstance(node, RayNode)
    rays = FrameRays.of(camera)
    regions = deal_regions(camera.width, camera.height, rank, 2)
    node.begin(1, [march.start(region, rays) for region in regions])
    return node


def sent(node: MarchRayNode) -> list[Message]:
    found = []
    while node.is_active:
        found += node.advance(1)
    return found


def test_a_frame_given_up_takes_no_ray_back(scene: Scene, outside: Camera) -> None:
    node = begun(scene, outside, 0)
    messages = [m for m in sent(node) if m.kind is MessageKind.RAYS]
    assert node.is_waiting
    node.cancel()
    assert node.is_finished
    for message in messages:
        assert node.handle(message._replace(kind=MessageKind.RETURN)) == []
        assert not node.is_active


@pytest.mark.parametrize("cut", [0, 5, 60, -1])
def test_rays_that_came_damaged_are_refused(
    scene: Scene, outside: Camera, cut: int
) -> None:
    nodes = [begun(scene, outside, rank) for rank in (0, 1)]
    message = next(m for m in sent(nodes[0]) if m.kind is MessageKind.RAYS)
    with pytest.raises(ProtocolError, match="rays came with"):
        nodes[1].handle(message._replace(payload=message.payload[:cut]))


def test_rays_that_were_never_sent_do_not_come_home(
    scene: Scene, outside: Camera
) -> None:
    node = begun(scene, outside, 0)
    # No ray: origin 0, packet 99.
    payload = np.array([0, 99, 0, 0], "<u4").tobytes()
    message = Message(MessageKind.RETURN, 1, 0, 1, payload=payload)
    with pytest.raises(ProtocolError, match="packet 99 of rank 0 came here"):
        node.handle(message)
    with pytest.raises(ProtocolError, match="REQUEST came where rays travel"):
        node.handle(message._replace(kind=MessageKind.REQUEST))
