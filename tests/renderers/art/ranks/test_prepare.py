from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.simulated_ranks.audit import audit
from renderers.art import ActiveRayTracer
from renderers.art.cells.cells import CellShare
from renderers.art.march import FrameRays, March
from renderers.art.quality import Quality
from renderers.art.ranks.messages import MessageKind
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.prepare import MarchNode, edit_node, make_node, slots_of
from renderers.art.ranks.work import MarchWork
from renderers.art.regions import Gather, deal_regions
from renderers.art.tracer import classic_image
from renderers.scene import Camera, Scene
from tests.loop_back import LoopBack
from tests.slow_cases import slow

QUALITY = Quality(0.5, 1 / 1024)
RANKS = 3
CLEAR = -300
"""A density that the scene's transfer function does not show."""

Made = list[tuple[March, MarchNode, MarchWork]]


def make(
    scene: Scene,
    dataflow: Dataflow,
    cells: int | None = None,
    *,
    from_file: bool = False,
) -> Made:
    return [
        make_node(
            scene,
            "classic",
            QUALITY,
            rank=rank,
            ranks=RANKS,
            policy=CellPolicy(cells, dataflow, from_file),
            validate=True,
        )
        for rank in range(RANKS)
    ]


def draw(made: Made, camera: Camera, frame: int, seed: int) -> NDArray[np.float32]:
    random = np.random.default_rng(seed)
    joint, rays = LoopBack(RANKS, seed, delay=0.2), FrameRays.of(camera)
    gather = Gather(camera.width, camera.height)
    nodes = [node for _, node, _ in made]
    for rank, (march, node, _) in enumerate(made):
        regions = deal_regions(camera.width, camera.height, rank, RANKS)
        node.begin(frame, [march.start(region, rays) for region in regions])
    while not all(node.is_finished for node in nodes):
        node = nodes[int(random.integers(RANKS))]
        sent = node.advance(1)
        message = joint.take(node.rank)
        if message is not None:
            sent += node.handle(message)
        for answer in sent:
            if answer.kind is MessageKind.REGION:
                gather.add_payload(answer.payload)
            else:
                joint.put(answer)
    assert joint.in_flight == 0
    return classic_image(gather).rgba


def without_a_piece(scene: Scene, corner: tuple[int, int, int], size: int) -> Scene:
    values = scene.volume.values.copy()
    where = tuple(slice(c, c + size) for c in corner)
    values[where] = CLEAR
    return replace(scene, volume=scene.volume.with_values(values, CLEAR))


@pytest.mark.parametrize(
    ("dataflow", "cells", "from_file"),
    [
        (Dataflow.MIGRATING, 9, True),
        (Dataflow.MIGRATING, 40, False),
        (Dataflow.STATIC, 9, False),
        (Dataflow.STATIC, 9, True),
        *slow(
            (Dataflow.MIGRATING, None, False),
            (Dataflow.MIGRATING, None, True),
            (Dataflow.STATIC, None, False),
            (Dataflow.REPLICATED, 9, False),
            (Dataflow.REPLICATED, None, False),
        ),
    ],
)
def test_after_an_edit_no_stale_cell_is_sampled_and_no_new_one_missed(
    scene: Scene,
    outside: Camera,
    dataflow: Dataflow,
    cells: int | None,
    from_file: bool,
) -> None:
    """Undoing an edit brings back cells that nobody owned, and takes them again."""
    hollow = without_a_piece(scene, (2, 2, 2), 24)
    cut = without_a_piece(scene, (9, 7, 12), 6)
    more = without_a_piece(cut, (20, 3, 25), 6)
    made = make(hollow, dataflow, cells, from_file=from_file)
    occupied, fetched, pictures = [], [], set()
    for frame, edited in enumerate((hollow, scene, cut, more, hollow, scene), start=1):
        if frame > 1:
            for rank, (_, node, work) in enumerate(made):
                march = edit_node(node, work, edited)
                assert march is not None
                made[rank] = march, node, work
        if dataflow is Dataflow.MIGRATING:
            audit([node for _, node, _ in made], [])
        drawn = draw(made, outside, frame, seed=frame)
        expected = ActiveRayTracer(edited, QUALITY, threads=1).render(outside)
        assert drawn.tobytes() == expected.rgba.tobytes()
        pictures.add(drawn.tobytes())
        occupied.append(made[0][2].occupied)
        fetched.append(sum(node.cache.fetches for _, node, _ in made))
    assert len(pictures) == 4
    assert occupied[1] > occupied[0]
    if cells is None:
        # Only what changed was fetched again.
        assert 0 < fetched[3] - fetched[1] < fetched[1] / 2


def test_cells_that_stay_in_the_file_need_no_room_and_are_shared(
    scene: Scene, outside: Camera
) -> None:
    made = make(scene, Dataflow.MIGRATING, 5, from_file=True)
    drawn = draw(made, outside, 1, seed=3)
    expected = ActiveRayTracer(scene, QUALITY, threads=1).render(outside)
    assert drawn.tobytes() == expected.rgba.tobytes()
    occupied = made[0][2].occupied
    for _, node, work in made:
        assert node.cache.owned == 0
        assert len(work.share) <= 5 < occupied / RANKS
        assert node.cache.evictions > 0


def test_a_cell_is_read_from_the_file_once_and_then_passed_on(
    scene: Scene, outside: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[int] = []
    take = CellShare.read

    def reading(share: CellShare, cell: int) -> NDArray[Any]:
        read.append(cell)
        return take(share, cell)

    monkeypatch.setattr(CellShare, "read", reading)
    made = make(scene, Dataflow.MIGRATING, from_file=True)
    draw(made, outside, 1, seed=3)
    fetched = sum(node.cache.fetches for _, node, _ in made)
    assert 0 < len(read) == len(set(read)) < fetched


def test_an_edit_in_place_must_say_where(scene: Scene) -> None:
    values = scene.volume.values.copy()
    living = replace(scene, volume=scene.volume.with_values(values, CLEAR))
    _, node, work = make_node(living, "classic", QUALITY)
    values[4, 5, 6] = CLEAR
    with pytest.raises(ValueError, match="edited in place cannot be compared"):
        edit_node(node, work, living)
    at = np.array([6, 5, 4])
    assert edit_node(node, work, living, (at, at)) is not None


def test_another_kind_of_volume_is_no_edit(scene: Scene) -> None:
    _, node, work = make(scene, Dataflow.MIGRATING)[0]
    wide = scene.volume.with_values(scene.volume.values.astype(np.float32), CLEAR)
    other = replace(scene, volume=wide)
    assert edit_node(node, work, other) is None


def test_caches_hold_every_cell_and_leave_room_to_work() -> None:
    assert slots_of(100, 4, None) == (100, 62)
    assert slots_of(100, 4, 26) == (26, 25)
    assert slots_of(100, 1, None) == (101, 100)
    for wanted in range(26, 200):
        slots, quota = slots_of(100, 4, wanted)
        assert slots == wanted
        assert 25 <= quota < slots
    with pytest.raises(ValueError, match=r"100 cells over 4 .* 26 .* got 25"):
        slots_of(100, 4, 25)


def test_a_rank_is_one_of_them(scene: Scene) -> None:
    with pytest.raises(ValueError, match="rank must be 0 to 1"):
        make_node(scene, "classic", QUALITY, rank=2, ranks=2)
    with pytest.raises(ValueError, match="at least 1 cell, got 0"):
        make_node(scene, "classic", QUALITY, policy=CellPolicy(0))
