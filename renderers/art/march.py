"""What happens to a ray inside the volume, in each of the two modes.

A march turns the vocabulary into the arrays a kernel takes. It knows which values
cannot be seen (`clear`), so that cells and cubes without anything else are leapt over.

Rays that come near a deflector are deflected: they look where the tissue was. They are
cut into finer steps, so that what they see moves by no more than a step from sample to
sample. All other rays have the same bits as without any deflector.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from renderers.art.blocks import Blocks, DrawBlocks, Strip, draw_strip
from renderers.art.classification import (
    classification,
    clear_intervals,
    sums_at_nodes,
)
from renderers.art.kernels.march_types import (
    F32,
    CellView,
    Deflectors,
    LensRays,
    RayArrays,
    RaySetUp,
    ShadeSettings,
)
from renderers.art.quality import Quality
from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.rays import RayPacket
from renderers.art.regions import Gather, Region
from renderers.scene import Camera, Projection, Scene, Volume
from renderers.scene.deflection import Cut, Deflection, maps_of

COUNTERS = ("samples", "contributing", "skipped", "deflected")
"""Names of the kernels' counters; deflected: samples that deflectors moved."""

PACKET = 32
"""Rays that march together; of 4 to 64 the fastest with and without AVX-512."""

SLACK_VOXELS = 0.01
"""Rays are deflected that come so near to a ball: more than float32 places are off."""

LEAF_STEPS = 4
"""Steps to the air surface in one of others, where a cut leaves thin leaves standing:
.05 mm at half a voxel of 0.5 mm. Air is leapt over."""

LARGEST_COUNT = 1 << 22
"""Samples on one ray, at most; float32 tells them apart with a bracket between."""


class March(Protocol):
    """Promise what a node needs to know of a mode.

    clear: intervals of values that cannot be seen. margin: cubes around what can be
    that have to be sampled as well.
    """

    volume: Volume
    quality: Quality
    clear: NDArray[np.float32]
    needs_gradients: bool
    seeks_values: bool
    margin: int

    def start(self, region: Region, rays: "FrameRays") -> RayPacket:
        """Put the rays of a region at their first samples."""
        ...

    def run(
        self, packet: RayPacket, view: CellView, shift: int, clock: int
    ) -> NDArray[np.int64]:
        """Move each ray until it ends or misses a cell; return the counters."""
        ...

    def ended_early(self, packet: RayPacket) -> int:
        """Count a finished packet's rays that ended before their way did."""
        ...

    @property
    def drawer(self) -> "Drawer | None":
        """Return what draws blocks at once; None where rays go by packets only."""
        ...


@dataclass(frozen=True, slots=True)
class FrameRays:
    """A camera's rays: `Camera.lens_table` and `Camera.frame`.

    limit: float32 ``(h, w)`` mm along a ray to its end; +inf where nothing stops it,
    and, unless `is_limited`, everywhere.
    """

    table: NDArray[np.float32]
    frame: NDArray[np.float64]
    orthographic: bool
    limit: NDArray[np.float32]
    is_limited: bool = True

    @classmethod
    def of(
        cls, camera: Camera, limit_mm: NDArray[np.float32] | None = None
    ) -> "FrameRays":
        """Ask the camera; raise ValueError where limits do not fit it."""
        shape = camera.height, camera.width
        limit = np.full(shape, np.inf, np.float32)
        if limit_mm is not None:
            if limit_mm.shape != shape or np.isnan(limit_mm).any():
                raise ValueError(
                    f"limits of rays must be numbers of shape {shape}, got shape "
                    f"{limit_mm.shape} with {np.isnan(limit_mm).sum()} NaN"
                )
            limit[:] = limit_mm
        # A copy, because compiled code tells what may be written from what may not.
        return cls(
            camera.lens_table(),
            camera.frame.copy(),
            camera.projection is Projection.ORTHOGRAPHIC,
            limit,
            limit_mm is not None,
        )


Drawer = Callable[[Blocks, int, FrameRays, Gather, CellView, int], Strip]
"""Draws blocks as one of several threads, of a number, taking turns with the others.

In a view of bricks, with a shift from voxels to them. Which are used is not noted.
"""


def _read_only(part: NDArray[np.float32]) -> NDArray[np.float32]:
    """Lay a part of an array out in a row, copied only where it does not lie so.

    Compiled code tells what may be written from what may not: here nothing may.
    """
    part = np.ascontiguousarray(part)
    part.flags.writeable = False
    return part


MarchKernel = Callable[..., None]
"""Moves `RayArrays` on; see `renderers.art.kernels.march_packets`."""


@cache
def _classic_kernel(
    width: int, lit: bool, integrated: bool, deflected: bool
) -> MarchKernel:
    from renderers.art.kernels.march_packets import march_packets

    return march_packets(width, lit, integrated, deflected)


@cache
def _surface_kernel(width: int, deflected: bool) -> MarchKernel:
    from renderers.art.kernels.find_surface import seek_packets, settle_packets

    seek, settle = seek_packets(width, deflected), settle_packets(width, deflected)

    def find_surfaces(
        rays: RayArrays, view: CellView, shift: int, clock: int, spacing: F32,
        deflectors: Deflectors, counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        seek(rays, view, shift, clock, spacing, deflectors, counters)
        settle(rays, view, shift, clock, spacing, deflectors, counters)

    return find_surfaces


class _Marching(ABC):
    """Set up rays, which both modes do alike.

    packet: rays that march together: 4, 8, 16, 32 or 64; by packets of any width a
    picture has the same bits. None: `PACKET`, and blocks are drawn at once where they
    can be: not where rays are deflected.
    """

    at_ends = False
    takes_along = False
    needs_gradients = True
    seeks_values = True
    margin = 0
    clear: NDArray[np.float32]
    _draw: DrawBlocks | None = None
    _least_left = 0.5
    """Of a ray that did not end early there is at least so much left; half of one that
    met no surface, of which all is."""

    def __init__(
        self,
        volume: Volume,
        quality: Quality,
        packet: int | None,
        deflection: Deflection | None,
    ) -> None:
        if packet not in (None, 4, 8, 16, 32, 64):
            raise ValueError(f"a packet has 4, 8, 16, 32 or 64 rays, got {packet!r}")
        if volume.values.dtype.kind == "f" and not np.isfinite(volume.values).all():
            raise ValueError(
                "the volume holds values that are not finite; replace them, for "
                "instance by its background"
            )
        self.volume = volume
        self.quality = quality
        self.step_mm = float(quality.step_voxels * volume.spacing_mm.min())
        size = np.array(volume.shape[::-1]) - 1
        diagonal_mm = float(np.linalg.norm(size * volume.spacing_mm))
        if diagonal_mm / self.step_mm > LARGEST_COUNT:
            raise ValueError(
                f"a step of {self.step_mm} mm through {diagonal_mm:.0f} mm makes more "
                f"than {LARGEST_COUNT} samples; choose a larger one"
            )
        self._top = size.astype(np.float64)
        self._voxel_from_world = np.array(volume.voxel_from_world)
        self._width = PACKET if packet is None else packet
        self._spacing = volume.spacing_mm.astype(np.float32)
        deflection = deflection or Deflection(())
        self._deflectors = Deflectors(
            maps_of(deflection, volume),
            float(deflection.stretch),
            any(isinstance(d, Cut) for d in deflection.deflectors),
        )
        self._at_once = packet is None and not deflection.deflectors

    def start(self, region: Region, rays: FrameRays) -> RayPacket:
        """Put the rays of a region at their first samples."""
        packet = self._start(region, rays, self.step_mm)
        if len(self._deflectors.maps):
            self._cut_finer(packet, rays)
        return packet

    def _start(self, region: Region, rays: FrameRays, step_mm: float) -> RayPacket:
        from renderers.art.kernels.set_up_rays import set_up_rays

        n = region.pixels
        geometry = np.empty((n + 1, 8), np.float32)
        geometry[n] = 0
        count = np.empty(n, np.int32)
        set_up_rays(
            _read_only(rays.table[region.rows, region.columns]).reshape(n, 3),
            _read_only(rays.limit[region.rows, region.columns]).reshape(n),
            rays.frame,
            rays.orthographic,
            self._voxel_from_world,
            self._top,
            step_mm,
            self.at_ends,
            geometry,
            count,
        )
        return RayPacket.start(region, geometry, count, takes_along=self.takes_along)

    def _cut_finer(self, packet: RayPacket, rays: FrameRays) -> None:
        """Tell the rays that are deflected from the others, and shorten their steps."""
        from renderers.scene.kernels.deflect import find_bent

        maps, stretch, has_cut = self._deflectors
        spacing = self.volume.spacing_mm
        near = np.zeros(len(packet.count), np.bool_)
        slack = SLACK_VOXELS * float(spacing.min())
        find_bent(maps, packet.geometry, packet.count, spacing, slack, near)
        if near.any():
            leaves = LEAF_STEPS if has_cut and isinstance(self, ScopeMarch) else 1
            step_mm = self.step_mm / (stretch * leaves)
            fine = self._start(packet.region, rays, step_mm)
            packet.geometry[:-1][near] = fine.geometry[:-1][near]
            packet.count[near] = fine.count[near]
        chosen = near[packet.order]
        packet.deflected = np.ascontiguousarray(packet.order[chosen])
        packet.order = np.ascontiguousarray(packet.order[~chosen])

    def run(
        self, packet: RayPacket, view: CellView, shift: int, clock: int
    ) -> NDArray[np.int64]:
        """Move each ray until it ends or misses a cell; return the counters."""
        counters = np.zeros(len(COUNTERS), np.int64)
        settings = self._settings(view)
        for order, deflected in (packet.order, False), (packet.deflected, True):
            if len(order):
                rays = packet.arrays._replace(order=order)
                self._kernel(deflected)(
                    rays, view, shift, clock, settings, self._deflectors, counters
                )
        return counters

    def ended_early(self, packet: RayPacket) -> int:
        """Count the rays that ended before their way did."""
        left = 1 - (packet.value[:-1, 3] + packet.carry[:-1, 3])
        return int(np.count_nonzero(left < np.float32(self._least_left)))

    @property
    def drawer(self) -> Drawer | None:
        """Return what draws blocks at once, where there is a kernel for it.

        Fine pictures, of float32, go by packets: their rays march for most of the time,
        and a kernel more would have to be compiled.
        """
        return None if self._draw is None else partial(self._draw_blocks, self._draw)

    def _draw_blocks(
        self,
        kernel: DrawBlocks,
        blocks: Blocks,
        who: int,
        rays: FrameRays,
        gather: Gather,
        view: CellView,
        shift: int,
    ) -> Strip:
        return draw_strip(
            kernel,
            blocks,
            who,
            LensRays(rays.table, rays.limit, rays.frame, rays.orthographic),
            RaySetUp(
                self._voxel_from_world,
                self._top,
                self.step_mm,
                self.at_ends,
                np.float32(self._least_left),
            ),
            gather,
            (view, shift, self._settings(view)),
            np.zeros(len(COUNTERS), np.int64),
            takes_along=self.takes_along,
        )

    @abstractmethod
    def _kernel(self, deflected: bool) -> MarchKernel:
        """Return what moves rays, deflected ones or the others."""

    @abstractmethod
    def _settings(self, view: CellView) -> ShadeSettings | F32:
        """Return what the kernels composite or measure by."""


class ClassicMarch(_Marching):
    """Classify, shade and composite samples, or the segments between them.

    Post-classified, a step has the extinction and the colour of its middle: what the
    density passes between two samples is missed. Integrated (pre-integrated: Engel,
    Kraus and Ertl, Graphics Hardware 2001:9; Roettger and Ertl, IEEE VolVis 2002:23), a
    step has what the transfer function says all along from the density at its one end
    to that at its other. Here nothing is tabulated over pairs of densities: pieces of
    straight lines between the user's own nodes have closed forms, so that a jump, or a
    spike as thin as one likes, stays where it was put, at any step. A segment is shaded
    in its middle, with the mean of the gradients at its ends: of second order, and the
    end in air has a small gradient and hence little say.

    Integrating rays that step from a cube to one that touches it, or less far, leap
    over whatever is clear: the two share a corner, so that what is clear in both is of
    one interval. In longer steps they might pass something between two clear intervals,
    and leap over one of them only.
    """

    def __init__(
        self,
        scene: Scene,
        quality: Quality,
        value_range: tuple[float, float],
        packet: int | None = None,
        deflection: Deflection | None = None,
    ) -> None:
        """Take the volume's smallest and largest value, which the caller knows."""
        super().__init__(scene.volume, quality, packet, deflection)
        integrated = quality.classification == "integrated"
        self.at_ends = self.takes_along = integrated
        if integrated:
            # Empty samples are taken beside others: a step reaches no farther than so
            # many cubes along an axis.
            self.margin = int(quality.step_voxels * 1.001) + 1
        self._least_left = quality.cutoff
        self.clear = clear_intervals(scene.transfer_function)
        volume = scene.volume
        material = scene.material
        # lights that give nothing back are left out: they would add zeros
        weight = max(material.diffuse, material.specular)
        lights = [light for light in scene.lights if weight * light.color.max() > 0]
        # Else a sample has the transfer function's colour, whatever its normal.
        self.needs_gradients = lit = len(lights) > 0 or material.ambient != 1
        self.seeks_values = not lit
        if self._at_once and quality.compact:
            from renderers.art.kernels import draw_blocks as compiled

            post = compiled.draw_lit if lit else compiled.draw_unlit
            segments = (
                compiled.draw_integrated if lit else compiled.draw_integrated_unlit
            )
            self._draw = segments if integrated else post
        # Lights are turned into the array's axes, and multiplied by what the material
        # gives back, once instead of at every sample.
        rows = np.zeros((len(lights), 10), np.float32)
        for row, light in zip(rows, lights, strict=True):
            origin = volume.origin_mm if light.is_local else np.zeros(3)
            row[:3] = volume.direction.T @ (light.vector - origin)
            row[3:6] = material.diffuse * light.color
            row[6:9] = material.specular * light.color
            row[9] = light.is_local
        # Below this a gradient is rounding, and a normal made of it is noise.
        self._least_gradient = max(1e-6 * (value_range[1] - value_range[0]), 1e-30)
        table = classification(scene.transfer_function)
        self._shade = ShadeSettings(
            table,
            sums_at_nodes(table),
            rows,
            np.array(
                [material.ambient, material.specular, material.shininess], np.float32
            ),
            self._spacing,
            np.float32(self._least_gradient),
            np.float32(quality.cutoff),
            quality.renormalise,
        )

    def run(
        self, packet: RayPacket, view: CellView, shift: int, clock: int
    ) -> NDArray[np.int64]:
        """Composite each ray until it ends or misses a cell."""
        if self.takes_along and len(packet.front) <= len(packet.count):
            raise ProtocolError("rays came without their last samples")
        return super().run(packet, view, shift, clock)

    def _kernel(self, deflected: bool) -> MarchKernel:
        return _classic_kernel(
            self._width, self.needs_gradients, self.takes_along, deflected
        )

    def _settings(self, view: CellView) -> ShadeSettings:
        least = np.float32(self._least_gradient / view.gradient_unit)
        return self._shade._replace(least_gradient=least)


class ScopeMarch(_Marching):
    """Find the zero of the air distance, sampling at both ends of steps.

    A ray's value becomes (normal, coverage), along the array's axes.
    """

    at_ends = True

    def __init__(
        self,
        scene: Scene,
        quality: Quality,
        packet: int | None = None,
        deflection: Deflection | None = None,
    ) -> None:
        if scene.surface is None:
            raise ValueError("the scene has no air surface; mode scope needs one")
        super().__init__(scene.surface.distance, quality, packet, deflection)
        self.clear = np.array([[-math.inf, 0.0]], np.float32)
        if self._at_once:
            from renderers.art.kernels.draw_blocks import draw_surface

            self._draw = draw_surface

    def _kernel(self, deflected: bool) -> MarchKernel:
        return _surface_kernel(self._width, deflected)

    def _settings(self, view: CellView) -> F32:
        return self._spacing
