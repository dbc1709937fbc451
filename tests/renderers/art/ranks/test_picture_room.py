"""Ranks that share a picture, here threads: each ray once, the same bits as alone."""

import numpy as np
import pytest

from benchmarks.ranks.orbits import folded_scene, orbit
from renderers.art import ActiveRayTracer
from renderers.art.crew import MachineCrew
from renderers.art.march import FrameRays
from renderers.art.quality import Quality
from renderers.art.ranks.picture_room import PictureRoom
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.prepare import make_node
from renderers.art.regions import Gather
from renderers.scene import Camera
from tests.renderers.art.threaded_crew import RANKS, together

SIZES = (70, 70, 96, 33)
KEPT = 16
"""Rows that are there already."""


@pytest.fixture(scope="module")
def views() -> list[Camera]:
    """Get views of several sizes, so that room has to be made anew between."""
    cameras = orbit(40, 96, len(SIZES))
    return [
        camera.with_size(size, size + 5)
        for camera, size in zip(cameras, SIZES, strict=True)
    ]


@pytest.mark.parametrize("keeps", [False, True])
def test_together_they_draw_each_ray_once_and_the_same_bits(
    views: list[Camera], keeps: bool
) -> None:
    """keeps: a part of each picture is there already, and stays."""
    scene = folded_scene(40)
    policy = CellPolicy(dataflow=Dataflow.SHARED)

    def draw(crew: MachineCrew) -> tuple[int, list[Gather]]:
        rank = crew.company.rank
        march, node, work = make_node(
            scene,
            "classic",
            Quality.named("snapshot"),
            rank=rank,
            ranks=RANKS,
            policy=policy,
            cell_side=None,
            crew=crew,
        )
        room, drawn, pictures = PictureRoom(crew), 0, []
        for frame, camera in enumerate(views, 1):
            gather = Gather(camera.width, camera.height)
            finished = np.zeros(gather.done.shape, np.bool_)
            if keeps:
                finished[:KEPT] = True
                gather.done[finished], gather.value[finished] = True, 0.25
            if not room.fits(gather):
                room.make(gather)
            elif rank == 0:
                room.begin(gather)
            crew.once(lambda: None)  # stands for the order to draw
            room.enter(gather)
            work.deliver(gather)
            drawer = march.drawer
            assert drawer is not None
            before = gather.missing
            turns = room.turns(rank, drawer, work, FrameRays.of(camera), finished)
            node.begin(frame, ())
            while (packets := turns()) is not None:
                node.add(packets)
                while node.is_active:
                    assert not node.advance(4)
            drawn += before - gather.missing
            crew.once(lambda: None)  # all are done
            if rank == 0:
                room.leave(gather)
                assert gather.missing == 0
                pictures.append(gather)
            crew.once(lambda: None)
        return drawn, pictures

    found = together(draw)
    fresh = sum(camera.width * (camera.height - keeps * KEPT) for camera in views)
    assert sum(drawn for drawn, _ in found) == fresh
    tracer = ActiveRayTracer(scene, "snapshot", threads=1)
    for camera, gather in zip(views, found[0][1], strict=True):
        expected = tracer.render(camera)
        assert expected.depth_mm is not None
        rays = np.ones(gather.done.shape, np.bool_)
        if keeps:
            rays[:KEPT] = False
            assert np.all(gather.value[~rays] == 0.25)
        assert np.array_equal(gather.value[rays], expected.rgba[rays])
        assert np.array_equal(gather.depth[rays], expected.depth_mm[rays])
