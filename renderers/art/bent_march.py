"""A march whose rays are bent where deflectors reach, and only there.

Rays that miss every ball go the usual way, with the usual kernels and the same bits as
without any deflector. The others are cut into finer steps, so that what they see moves
by no more than a step from sample to sample.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.art.cells.brick_views import CellView
from renderers.art.integrated_march import IntegratedMarch
from renderers.art.march import COUNTERS, ClassicMarch, Drawer, FrameRays, ScopeMarch
from renderers.art.ranks.rays import RayPacket
from renderers.art.regions import Region
from renderers.scene.deflection import Cut, Deflection, maps_of

SLACK_VOXELS = 0.01
"""Rays are bent that come so near to a ball: more than float32 places are off."""

LEAF_STEPS = 4
"""Steps to the air surface in one of others, where a cut leaves thin leaves standing:
.05 mm at half a voxel of 0.5 mm. Air is leapt over."""


@dataclass(slots=True, eq=False)
class _BentPacket(RayPacket):
    """Hold a region's rays; `order` lists the straight ones, `bent` the others."""

    bent: NDArray[np.int32]


class BentMarch:
    """March straight rays as another march does, and bend the others."""

    drawer: Drawer | None = None

    def __init__(
        self, straight: ClassicMarch | ScopeMarch, deflection: Deflection
    ) -> None:
        """Take the march of straight rays, of either mode and classification."""
        self.volume = straight.volume
        self.quality = straight.quality
        self.clear = straight.clear
        self.needs_gradients = straight.needs_gradients
        self.margin = straight.margin
        # bent rays read bricks
        self.seeks_values = False
        self._straight = straight
        self._maps = maps_of(deflection, straight.volume)
        self._stretch = deflection.stretch
        self._has_cut = any(isinstance(d, Cut) for d in deflection.deflectors)

    def start(self, region: Region, rays: FrameRays) -> RayPacket:
        """Put the rays of a region at their first samples."""
        from renderers.scene.kernels.deflect import find_bent

        packet = self._straight.start(region, rays)
        spacing = self.volume.spacing_mm
        bent = np.zeros(len(packet.count), np.bool_)
        slack = SLACK_VOXELS * float(spacing.min())
        find_bent(self._maps, packet.geometry, packet.count, spacing, slack, bent)
        if bent.any():
            finer = self._stretch
            if self._has_cut and isinstance(self._straight, ScopeMarch):
                finer *= LEAF_STEPS
            fine = self._straight.start(region, rays, finer=finer)
            packet.geometry[:-1][bent] = fine.geometry[:-1][bent]
            packet.count[bent] = fine.count[bent]
        chosen = bent[packet.order]
        return _BentPacket(
            packet.region,
            np.ascontiguousarray(packet.order[~chosen]),
            packet.geometry,
            packet.count,
            packet.cursor,
            packet.value,
            packet.carry,
            packet.depth,
            np.ascontiguousarray(packet.order[chosen]),
            front=packet.front,
        )

    def ended_early(self, packet: RayPacket) -> int:
        """Count a finished packet's rays that ended before their way did."""
        return self._straight.ended_early(packet)

    def run(
        self, packet: RayPacket, view: CellView, shift: int, clock: int
    ) -> NDArray[np.int64]:
        """Move each ray until it ends or misses a cell."""
        assert isinstance(packet, _BentPacket)
        straight = self._straight
        if len(packet.order):
            counters = straight.run(packet, view, shift, clock)
        else:
            counters = np.zeros(len(COUNTERS), np.int64)
        if not len(packet.bent):
            return counters
        rays: list[Any] = [packet.bent, packet.geometry, packet.count]
        rays += [packet.cursor, packet.value]
        if isinstance(straight, ScopeMarch):
            rays = [self._maps, self._stretch, *rays, packet.depth]
            look: tuple[Any, ...] = (self.volume.spacing_mm.astype(np.float32),)
        else:
            rays = [self._maps, self._stretch, self._has_cut, *rays]
            rays += [packet.carry, packet.depth]
            look = straight.look(view)
        if isinstance(straight, IntegratedMarch):
            rays += [packet.front, straight.sums]
        self._kernel()(*rays, view, shift, clock, *look, counters)
        return counters

    def _kernel(self) -> Callable[..., None]:
        from renderers.art.kernels.march_bent import march_classic, march_scope
        from renderers.art.kernels.march_bent_integrated import march_integrated

        if isinstance(self._straight, ScopeMarch):
            return march_scope
        if isinstance(self._straight, IntegratedMarch):
            return march_integrated
        return march_classic
