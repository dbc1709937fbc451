"""The march of a transfer function that is integrated between samples.

Post-classified, a step has the extinction and the colour of its middle: what the
density passes between two samples is missed. Integrated (pre-integrated: Engel, Kraus
and Ertl, Graphics Hardware 2001:9; Roettger and Ertl, IEEE VolVis 2002:23), a step has
what the transfer function says all along from the density at its one end to that at
its other. Here nothing is tabulated over pairs of densities: pieces of straight lines
between the user's own nodes have closed forms, so that a jump, or a spike as thin as
one likes, stays where it was put, at any step.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.art.cells.brick_views import CellView, Classification
from renderers.art.march import ClassicMarch, FrameRays
from renderers.art.quality import Quality
from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.rays import RayPacket
from renderers.art.regions import Region
from renderers.scene import Scene

_DIGITS = 23
"""Of the larger part of a sum: differences of such parts are exact in float32."""


def sums_at_nodes(table: Classification) -> NDArray[np.float32]:
    """Sum extinction, and extinction times colour, over density up to each piece.

    Gives float32 (pieces, 8): extinction, red, green and blue in pairs; the two
    numbers of a pair add up to the sum, to 48 bits of the largest. Equal sums, over
    what is clear, are equal bit for bit.
    """
    lower, upper, kappa, rise = table.extinction.astype(np.float64).T
    # Nothing lies before the first node, and nothing goes on from the last piece.
    width = np.where(np.isfinite(upper), upper - lower, 0.0)
    ends = kappa + rise * width
    color = table.color[:, :3].astype(np.float64)
    color_end = color + table.color_slope[:, :3] * width[:, None]
    mean = 0.5 * (kappa + ends)
    light = mean[:, None] * 0.5 * (color + color_end)
    light += ((ends - kappa) / 12)[:, None] * (color_end - color)
    pieces = np.column_stack([mean, light]) * width[:, None]
    sums = np.concatenate([np.zeros((1, 4)), np.cumsum(pieces, axis=0)[:-1]])
    _, exponent = np.frexp(sums.max(axis=0))
    grain = np.ldexp(1.0, exponent - _DIGITS)
    large = np.rint(sums / grain) * grain
    pairs = np.stack([large, sums - large], axis=-1).astype(np.float32)
    return np.ascontiguousarray(pairs.reshape(-1, 8))


@cache
def _integrated_kernel(width: int, lit: bool) -> Callable[..., None]:
    from renderers.art.kernels.march_integrated import integrated_packets

    return integrated_packets(width, lit)


class IntegratedMarch(ClassicMarch):
    """Classify, shade and composite the segments between samples.

    A segment is shaded in its middle, with the mean of the gradients at its ends: of
    second order, and the end in air has a small gradient and hence little say. Rays
    that step from a cube to one that touches it, or less far, leap over whatever is
    clear: the two share a corner, so that what is clear in both is of one interval. In
    longer steps they might pass something between two clear intervals, and leap over
    one of them only. sums: what `sums_at_nodes` gives.
    """

    at_ends = True
    takes_along = True

    def __init__(
        self,
        scene: Scene,
        quality: Quality,
        value_range: tuple[float, float],
        packet: int | None = None,
    ) -> None:
        """Take what `ClassicMarch` takes."""
        super().__init__(scene, quality, value_range, packet)
        # Empty samples are taken beside others: a step reaches no farther than so many
        # cubes along an axis.
        self.margin = int(quality.step_voxels * 1.001) + 1
        self.sums = sums_at_nodes(self.table)

    def _choose_kernels(self) -> None:
        """Take the compiled functions for packets of rays, and for blocks at once."""
        lit = self.needs_gradients
        self._march = _integrated_kernel(self._width, lit)
        if self._at_once:
            from renderers.art.kernels.draw_blocks import (
                draw_integrated,
                draw_integrated_unlit,
            )

            self._draw = draw_integrated if lit else draw_integrated_unlit

    def start(
        self, region: Region, rays: FrameRays, *, finer: float = 1.0
    ) -> RayPacket:
        """Put the rays of a region at their first samples."""
        packet = super().start(region, rays, finer=finer)
        packet.front = np.zeros((len(packet.count) + 1, 4), np.float32)
        return packet

    def run(
        self, packet: RayPacket, view: CellView, shift: int, clock: int
    ) -> NDArray[np.int64]:
        """Composite each ray until it ends or misses a cell."""
        if len(packet.front) <= len(packet.count):
            raise ProtocolError("rays came without their last samples")
        return super().run(packet, view, shift, clock)

    def _rest(self, view: CellView, shift: int, clock: int) -> tuple[Any, ...]:
        return self.sums, *super()._rest(view, shift, clock)
