"""Frame after frame by the ranks of a transport, without a queue of jobs.

Cells stay between frames, as the paper's animations have it. All ranks call the same
functions in the same order.
"""

from collections.abc import Sequence

from renderers.art.march import FrameRays, March
from renderers.art.ranks.rank import FrameNode, Rank
from renderers.art.ranks.rays import RayPacket
from renderers.art.regions import Gather, deal_regions
from renderers.scene import Camera


class FrameSeries:
    """Draw with nodes that are kept."""

    def __init__(
        self,
        rank: Rank,
        march: March,
        node: FrameNode,
        region_px: int | None = None,
        *,
        first_frame: int = 0,
    ) -> None:
        """Take what was made for this rank.

        region_px: see `deal_regions`. first_frame: frames this rank has drawn before.
        """
        self._rank = rank
        self._march = march
        self._node = node
        self._region_px = region_px
        self._frame = first_frame

    def packets(self, camera: Camera) -> Sequence[RayPacket]:
        """Put this rank's rays of a frame at their first samples."""
        transport = self._rank.transport
        rays = FrameRays.of(camera)
        regions = deal_regions(
            camera.width,
            camera.height,
            transport.rank,
            transport.ranks,
            self._region_px,
        )
        return [self._march.start(region, rays) for region in regions]

    def draw(self, camera: Camera) -> Gather | None:
        """Draw a frame; rank 0 gets the picture, the others None."""
        rank = self._rank
        self._frame += 1
        gather = None
        if rank.transport.rank == 0:
            gather = Gather(camera.width, camera.height)
        packets = self.packets(camera)
        rank.begin(self._frame, self._node, packets, gather)
        while rank.is_drawing:
            if gather is not None and rank.is_complete:
                rank.end()
            elif not rank.step():
                rank.rest()
        return gather
