import pytest

from renderers.art.cache import CellState
from renderers.art.march import FrameRays
from renderers.art.messages import Message, MessageKind, ProtocolError
from renderers.art.node import MOST_PENDING, Node
from renderers.art.quality import Quality
from renderers.art.regions import deal_regions
from renderers.art.tracer import make_node
from renderers.scene import Camera, Scene


def begun(scene: Scene, camera: Camera, rank: int, cells: int | None = None) -> Node:
    march, node = make_node(
        scene,
        "classic",
        Quality(0.5, 0.0),
        rank=rank,
        ranks=2,
        cache_cells=cells,
        validate=True,
    )
    rays = FrameRays.of(camera)
    regions = deal_regions(camera.width, camera.height, rank, 2)
    node.begin(1, [march.start(region, rays) for region in regions])
    return node


def requests(messages: list[Message]) -> list[Message]:
    return [m for m in messages if m.kind is MessageKind.REQUEST]


def test_rays_wait_for_a_cell_and_go_on_when_it_comes(
    scene: Scene, outside: Camera
) -> None:
    asker, home = begun(scene, outside, 0), begun(scene, outside, 1)
    asked: list[Message] = []
    while not asked:
        asked = requests(asker.advance(1))
    request = asked[0]
    assert (request.source, request.target) == (0, 1)
    assert asker.cache.state(request.cell) is CellState.PENDING
    assert asker.is_waiting
    assert not asker.is_finished
    (answer,) = home.handle(request)
    asker.handle(answer)
    assert asker.cache.state(request.cell) is CellState.VALID
    assert asker.is_active


def test_a_node_asks_once_and_not_for_everything_at_once(
    scene: Scene, outside: Camera
) -> None:
    node = begun(scene, outside, 0)
    asked = []
    for _ in range(50):
        asked += requests(node.advance(4))
    cells = [message.cell for message in asked]
    assert len(set(cells)) == len(cells) <= MOST_PENDING
    assert not node.is_active
    assert not node.is_finished


def test_requests_reserve_a_slot_first(scene: Scene, outside: Camera) -> None:
    node = begun(scene, outside, 0, cells=3)
    asked = []
    for _ in range(50):
        asked += requests(node.advance(4))
    assert len(asked) <= 3


def test_what_the_protocol_forbids_is_told_with_its_story(
    scene: Scene, outside: Camera
) -> None:
    asker, home = begun(scene, outside, 0), begun(scene, outside, 1)
    asked: list[Message] = []
    while not asked:
        asked = requests(asker.advance(1))
    (answer,) = home.handle(asked[0])
    asker.handle(answer)
    with pytest.raises(ProtocolError, match=r"VALID, not PENDING\. .*DATA of cell"):
        asker.handle(answer)
    with pytest.raises(ProtocolError, match="a message of frame 7 came in frame 1"):
        asker.handle(Message(MessageKind.REQUEST, 1, 0, 7))
    with pytest.raises(ProtocolError, match="cannot handle STOP"):
        asker.handle(Message(MessageKind.STOP, 1, 0, 1))
    with pytest.raises(ProtocolError, match="cannot follow frame 1"):
        asker.begin(1, [])


def test_leaving_forgets_rays_and_keeps_cells(scene: Scene, outside: Camera) -> None:
    node = begun(scene, outside, 0)
    for _ in range(5):
        node.advance(4)
    held = node.cache.fetches
    assert held > 0
    node.leave()
    node.check()
    assert node.is_finished
    assert sum(node.cache.state(c) is CellState.VALID for c in range(100)) == held
