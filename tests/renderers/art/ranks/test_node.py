import pytest

from renderers.art.march import FrameRays
from renderers.art.quality import Quality
from renderers.art.ranks.messages import Message, MessageKind, ProtocolError
from renderers.art.ranks.node import MOST_PENDING
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.prepare import MarchNode, make_node
from renderers.art.regions import deal_regions
from renderers.scene import Camera, Scene


def begun(
    scene: Scene,
    camera: Camera,
    rank: int,
    cells: int | None = None,
    dataflow: Dataflow = Dataflow.STATIC,
) -> MarchNode:
    march, node, _ = make_node(
        scene,
        "classic",
        Quality(0.5, 0.0),
        rank=rank,
        ranks=2,
        policy=CellPolicy(cells, dataflow),
        validate=True,
    )
    rays = FrameRays.of(camera)
    regions = deal_regions(camera.width, camera.height, rank, 2)
    node.begin(1, [march.start(region, rays) for region in regions])
    return node


def first_request(node: MarchNode) -> Message:
    """Let a node go on until it asks for a cell."""
    while not (asked := requests(node.advance(1))):
        pass
    return asked[0]


def requests(messages: list[Message]) -> list[Message]:
    return [m for m in messages if m.kind is MessageKind.REQUEST]


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
    (answer,) = home.handle(first_request(asker))
    asker.handle(answer)
    with pytest.raises(ProtocolError, match=r"VALID, not PENDING\. .*DATA of cell"):
        asker.handle(answer)
    with pytest.raises(ProtocolError, match="cannot handle STOP"):
        asker.handle(Message(MessageKind.STOP, 1, 0, 1))
    with pytest.raises(ProtocolError, match="cannot follow frame 1"):
        asker.begin(1, [])


def test_cancelling_drops_rays_and_keeps_cells(scene: Scene, outside: Camera) -> None:
    node, other = begun(scene, outside, 0), begun(scene, outside, 1)
    asked: list[Message] = []
    while not asked:
        asked = requests(node.advance(1))
    held = len([c for c in node.cache.cells() if node.cache.holds(c)])
    node.cancel()
    assert (node.is_active, node.is_finished) == (False, False)
    for request in asked:
        for answer in other.handle(request):
            node.handle(answer)
    assert not node.is_waiting
    assert len(node.cache.cells()) == held + len(asked)


def test_words_of_moving_cells_are_refused_where_cells_stay(
    scene: Scene, outside: Camera
) -> None:
    node = begun(scene, outside, 0)
    with pytest.raises(ProtocolError, match="KEEP came where cells do not migrate"):
        node.handle(Message(MessageKind.KEEP, 1, 0, 1, 3))


def test_a_volume_changes_between_frames_only(scene: Scene, outside: Camera) -> None:
    node = begun(scene, outside, 0)
    with pytest.raises(ProtocolError, match="only change between frames"):
        node.edit(1, [])
    node.cancel()
    node.edit(3, [])
    with pytest.raises(ProtocolError, match="generation 3 cannot follow 3"):
        node.edit(3, [])
    with pytest.raises(ProtocolError, match="of generation 1 came in generation 3"):
        node.handle(Message(MessageKind.REQUEST, 1, 0, 1, 0, generation=1))
