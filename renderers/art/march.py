"""What happens to a ray inside the volume, in each of the two modes.

A march turns the vocabulary into the arrays a kernel takes. It knows which values
cannot be seen (`clear`), so that cells and cubes without anything else are leapt over.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from renderers.art.blocks import Blocks, Strip, draw_strip
from renderers.art.cells.brick_views import CellView
from renderers.art.classification import classification, clear_intervals
from renderers.art.quality import Quality
from renderers.art.ranks.rays import RayPacket
from renderers.art.regions import Gather, Region
from renderers.scene import Camera, Projection, Scene, Volume

COUNTERS = ("samples", "contributing", "skipped", "bent")
"""Names of the kernels' counters; bent: places sought by way of deflectors."""

PACKET = 32
"""Rays that march together; of 4 to 64 the fastest with and without AVX-512."""

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
        """Get what draws blocks at once; None where rays go by packets only."""
        ...


@dataclass(frozen=True, slots=True)
class FrameRays:
    """Hold a camera's rays: `Camera.lens_table` and `Camera.frame`.

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


@cache
def _classic_kernel(width: int, lit: bool) -> Callable[..., None]:
    from renderers.art.kernels.march_packets import classic_packets

    return classic_packets(width, lit)


@cache
def _scope_kernel(width: int) -> Callable[..., None]:
    from renderers.art.kernels.find_surface import seek_packets, settle_packets

    seek, settle = seek_packets(width), settle_packets(width)

    def find_surfaces(*rays: Any) -> None:
        seek(*rays)
        settle(*rays)

    return find_surfaces


class _Marching(ABC):
    """Set up rays, which both modes do alike.

    packet: rays that march together: 4, 8, 16, 32 or 64; by packets of any width a
    picture has the same bits. None: `PACKET`, and blocks are drawn at once where they
    can be.
    """

    at_ends = False
    takes_along = False
    needs_gradients = True
    seeks_values = True
    margin = 0
    _march: Callable[..., None]
    _draw: Callable[..., tuple[int, int, int]] | None = None
    _least_left = 0.5
    """Of a ray that did not end early there is at least so much left; half of one that
    met no surface, of which all is."""

    def __init__(self, volume: Volume, quality: Quality, packet: int | None) -> None:
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
        self._at_once = packet is None and quality.compact
        self._spacing = volume.spacing_mm.astype(np.float32)

    def start(
        self, region: Region, rays: FrameRays, *, finer: float = 1.0
    ) -> RayPacket:
        """Put the rays of a region at their first samples, so many times as fine."""
        from renderers.art.kernels.set_up_rays import set_up_rays

        n = region.pixels
        geometry = np.empty((n + 1, 8), np.float32)
        geometry[n] = 0
        count = np.empty(n, np.int32)
        set_up_rays(
            _read_only(rays.table[region.rows, region.columns]).reshape(n, 3),
            _read_only(rays.limit[region.rows, region.columns]).reshape(n),
            0,
            rays.frame,
            rays.orthographic,
            self._voxel_from_world,
            self._top,
            self.step_mm / finer,
            self.at_ends,
            geometry,
            count,
        )
        return RayPacket.start(region, geometry, count)

    def run(
        self, packet: RayPacket, view: CellView, shift: int, clock: int
    ) -> NDArray[np.int64]:
        """Move each ray until it ends or misses a cell; return the counters."""
        counters = np.zeros(len(COUNTERS), np.int64)
        front = (packet.front,) if self.takes_along else ()
        self._march(*packet.arrays, *front, *self._rest(view, shift, clock), counters)
        return counters

    def ended_early(self, packet: RayPacket) -> int:
        """Count the rays that ended before their way did."""
        left = 1 - (packet.value[:-1, 3] + packet.carry[:-1, 3])
        return int(np.count_nonzero(left < np.float32(self._least_left)))

    @property
    def drawer(self) -> Drawer | None:
        """Get what draws blocks at once, where there is a kernel for it.

        Fine pictures, of float32, go by packets: their rays march for most of the time,
        and a kernel more would have to be compiled.
        """
        return None if self._draw is None else partial(self._draw_blocks, self._draw)

    def _draw_blocks(
        self,
        kernel: Callable[..., tuple[int, int, int]],
        blocks: Blocks,
        who: int,
        rays: FrameRays,
        gather: Gather,
        view: CellView,
        shift: int,
    ) -> Strip:
        counters = np.zeros(len(COUNTERS), np.int64)
        return draw_strip(
            kernel,
            blocks,
            who,
            (rays.table, rays.limit, rays.frame, rays.orthographic),
            (self._voxel_from_world, self._top, self.step_mm, self.at_ends),
            np.float32(self._least_left),
            gather,
            self._rest(view, shift, 0),
            counters,
            takes_along=self.takes_along,
        )

    @abstractmethod
    def _rest(self, view: CellView, shift: int, clock: int) -> tuple[Any, ...]:
        """Give what kernels take beside the rays."""


class ClassicMarch(_Marching):
    """Classify, shade and composite samples at the middles of steps."""

    def __init__(
        self,
        scene: Scene,
        quality: Quality,
        value_range: tuple[float, float],
        packet: int | None = None,
    ) -> None:
        """Take the volume's smallest and largest value, which the caller knows."""
        super().__init__(scene.volume, quality, packet)
        self._least_left = quality.cutoff
        self.clear = clear_intervals(scene.transfer_function)
        self.table = classification(scene.transfer_function)
        volume = scene.volume
        material = scene.material
        # lights that give nothing back are left out: they would add zeros
        weight = max(material.diffuse, material.specular)
        lights = [light for light in scene.lights if weight * light.color.max() > 0]
        # Else a sample has the transfer function's colour, whatever its normal.
        self.needs_gradients = len(lights) > 0 or material.ambient != 1
        self.seeks_values = not self.needs_gradients
        self._choose_kernels()
        self._material = np.array(
            [material.ambient, material.specular, material.shininess], np.float32
        )
        # Lights are turned into the array's axes, and multiplied by what the material
        # gives back, once instead of at every sample.
        self._lights = np.zeros((len(lights), 10), np.float32)
        for row, light in zip(self._lights, lights, strict=True):
            origin = volume.origin_mm if light.is_local else np.zeros(3)
            row[:3] = volume.direction.T @ (light.vector - origin)
            row[3:6] = material.diffuse * light.color
            row[6:9] = material.specular * light.color
            row[9] = light.is_local
        # Below this a gradient is rounding, and a normal made of it is noise.
        self._least_gradient = max(1e-6 * (value_range[1] - value_range[0]), 1e-30)

    def _choose_kernels(self) -> None:
        """Take the compiled functions for packets of rays, and for blocks at once."""
        self._march = _classic_kernel(self._width, self.needs_gradients)
        if self._at_once:
            from renderers.art.kernels.draw_blocks import draw_lit, draw_unlit

            self._draw = draw_lit if self.needs_gradients else draw_unlit

    def _rest(self, view: CellView, shift: int, clock: int) -> tuple[Any, ...]:
        return view, shift, clock, *self.look(view)

    def look(self, view: CellView) -> tuple[Any, ...]:
        """Give what kernels composite by: table, lights, material, spacing, limits."""
        return (
            self.table,
            self._lights,
            self._material,
            self._spacing,
            np.float32(self._least_gradient / view.gradient_unit),
            np.float32(self.quality.cutoff),
            self.quality.renormalise,
        )


class ScopeMarch(_Marching):
    """Find the zero of the air distance, sampling at both ends of steps.

    A ray's value becomes (normal, coverage), along the array's axes.
    """

    at_ends = True

    def __init__(
        self, scene: Scene, quality: Quality, packet: int | None = None
    ) -> None:
        if scene.surface is None:
            raise ValueError("the scene has no air surface; mode scope needs one")
        super().__init__(scene.surface.distance, quality, packet)
        self.clear = np.array([[-math.inf, 0.0]], np.float32)
        self._march = _scope_kernel(self._width)
        if packet is None:
            from renderers.art.kernels.draw_blocks import draw_scope

            self._draw = draw_scope

    def _rest(self, view: CellView, shift: int, clock: int) -> tuple[Any, ...]:
        return view, shift, clock, self._spacing
