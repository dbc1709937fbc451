"""What it costs to know which cell was used last, in our own cache."""

import time

import numpy as np

from renderers.art.march import FrameRays
from renderers.art.quality import Quality
from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.policy import CellPolicy
from renderers.art.ranks.prepare import MarchNode, make_node
from renderers.art.ranks.rays import RayPacket
from renderers.art.regions import deal_regions
from renderers.scene import Camera, Scene

PAPER_SHARE = 0.025
"""Of the time of the 1995 paper's ranks, as its text says."""

_ROUNDS = 7


def order_of_use(scene: Scene, quality: Quality, camera: Camera) -> dict[str, float]:
    """Measure a frame with and without noting each use, and the search for victims.

    share_stamps: of a frame's time, with every cell here, noting their use.
    share_victims: of a frame's time, with room for half of the cells, looking for the
    one used longest ago; evictions: of that frame.
    """
    rays = FrameRays.of(camera)
    regions = deal_regions(camera.width, camera.height, 0, 1)
    march, node, work = make_node(
        scene, "classic", quality, policy=CellPolicy(from_file=True)
    )

    def packets() -> list[RayPacket]:
        return [march.start(region, rays) for region in regions]

    _draw(node, packets())
    best = [np.inf, np.inf]
    for _ in range(_ROUNDS):
        for clock in (0, 1):
            drawn = packets()
            began = time.thread_time()
            missing = work.run(drawn, clock)
            best[clock] = min(best[clock], time.thread_time() - began)
            if any(missing):
                raise ProtocolError("a cell went that had room")
    without_s, with_s = best
    half = max(node.cache.fetches // 2, 1)
    _, tight, _ = make_node(
        scene, "classic", quality, policy=CellPolicy(half, from_file=True)
    )
    began = time.thread_time()
    _draw(tight, packets())
    whole_s = time.thread_time() - began
    victim_s = np.inf
    for _ in range(_ROUNDS):
        began = time.thread_time()
        for _ in range(100):
            tight.cache.victim()
        victim_s = min(victim_s, (time.thread_time() - began) / 100)
    return {
        "share_stamps": max(1 - without_s / with_s, 0.0),
        "share_victims": tight.cache.evictions * victim_s / whole_s,
        "frame_s": with_s,
        "victim_us": 1e6 * victim_s,
        "evictions": float(tight.cache.evictions),
        "slots": float(half),
        "paper_share": PAPER_SHARE,
    }


def _draw(node: MarchNode, packets: list[RayPacket]) -> None:
    node.begin(node.frame + 1, packets)
    while not node.is_finished:
        node.advance(1)
