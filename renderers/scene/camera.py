"""Where a picture is seen from, and which ray belongs to which pixel.

Camera frame: x right, y up, z forward (along the view axis). Pixel ``(row, column)``
of an ``height x width`` picture is sampled at its centre; row 0 is at the top.
Three projections: the rigid endoscope's *equidistant* lens ``r = f * theta``
(a rigid sinus scope shows 52 % of the size at the edge of its field, Laryngoscope
2015;125:561; theta / tan(theta) is .79 there and cos(theta)**2 .51, so the law needs
no coefficient), the pinhole, and the orthographic view. The first two may be distorted
(`renderers.scene.distortion`), as calibrations of real scopes find them.
"""

import math
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderers.scene.aiming import aimed
from renderers.scene.distortion import NO_DISTORTION, Distortion
from renderers.scene.memory_limit import memory_limit
from system import UserError

PIXEL_BYTES = 92
"""Taken for each pixel while a picture is drawn: lens table, rays, what they found."""

STOP_MARGIN_PX = 2.0
"""Rays are cast this far beyond the round field stop, so that its soft edge has
something to be soft over."""

WIDEST_PINHOLE = math.radians(89.0)
"""Half field of a pinhole: beyond it a few middle pixels hold all there is to see."""


class Projection(IntEnum):
    """Name a lens law. The numbers are what kernels receive."""

    EQUIDISTANT = 0
    PERSPECTIVE = 1
    ORTHOGRAPHIC = 2


_ORTHONORMAL = np.eye(3)
_TOLERANCE = 1e-6 + 1e-5 * _ORTHONORMAL
"""Largest departure of the products of a camera's axes."""


@lru_cache(maxsize=8)
def _lens_table(
    projection: Projection,
    extent: float,
    width: int,
    height: int,
    distortion: Distortion = NO_DISTORTION,
) -> NDArray[np.float32]:
    half = min(width, height) / 2
    x, y = np.meshgrid(
        (np.arange(width) + 0.5 - width / 2) / half,
        -(np.arange(height) + 0.5 - height / 2) / half,
    )
    table = np.zeros((height, width, 3))
    if not distortion.is_none:
        _distort(table, projection, extent, x, y, distortion)
        if projection is Projection.EQUIDISTANT:
            table[np.hypot(x, y) > 1 + STOP_MARGIN_PX / half] = 0
    elif projection is Projection.EQUIDISTANT:
        r = np.hypot(x, y)
        theta = r * extent
        # sin(theta)/r -> extent at the centre, where r is 0
        k = extent * np.sinc(theta / math.pi)
        table[..., 0], table[..., 1] = k * x, k * y
        table[..., 2] = np.cos(theta)
        table[r > 1 + STOP_MARGIN_PX / half] = 0
    elif projection is Projection.PERSPECTIVE:
        table[..., 0], table[..., 1] = x * math.tan(extent), y * math.tan(extent)
        table[..., 2] = 1
        table /= np.linalg.norm(table, axis=-1, keepdims=True)
    else:
        table[..., 0], table[..., 1] = x * extent, y * extent
        table[..., 2] = 1
    result = table.astype(np.float32)
    result.flags.writeable = False
    return result


def _distort(
    table: NDArray[np.float64],
    projection: Projection,
    extent: float,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    distortion: Distortion,
) -> None:
    """Fill a lens table; where the lens would fold there is no ray."""
    edge = math.tan(extent) if projection is Projection.PERSPECTIVE else extent
    r = np.hypot(x, y)
    u = distortion.inverse(r * float(distortion.of(np.array(edge))))
    seen = np.isfinite(u)
    theta = np.arctan(u) if projection is Projection.PERSPECTIVE else u
    # on the axis any direction will do: the sine is 0
    across = np.where(r > 0, r, 1.0)
    table[..., 0] = np.where(seen, np.sin(theta) * x / across, 0)
    table[..., 1] = np.where(seen, np.sin(theta) * y / across, 0)
    table[..., 2] = np.where(seen, np.cos(theta), 0)


@dataclass(frozen=True, slots=True)
class Camera:
    """Place an eye and its lens.

    frame: ``(4, 3)`` float64 world rows eye (mm), right, up, forward (unit).
    extent: for EQUIDISTANT and PERSPECTIVE the half field angle in radians that
        falls on the half of the picture's shorter side; for ORTHOGRAPHIC that half
        side in mm.
    width, height: picture size in pixels.
    distortion: of the lens. The extent keeps its meaning: the field that falls on the
        half of the shorter side, distortion included.
    """

    frame: NDArray[np.float64]
    extent: float
    width: int
    height: int
    projection: Projection = Projection.EQUIDISTANT
    distortion: Distortion = NO_DISTORTION

    def __post_init__(self) -> None:
        frame = np.array(self.frame, dtype=np.float64)
        if frame.shape != (4, 3) or not np.all(np.isfinite(frame)):
            raise UserError(f"camera frame must be finite (4, 3), got {frame.tolist()}")
        need = PIXEL_BYTES * self.width * self.height
        if self.width > 0 and self.height > 0 and need > memory_limit():
            raise UserError(
                f"a picture of {self.width} x {self.height} pixels needs {need:,} "
                f"bytes and at most {memory_limit():,} may be taken; draw it in parts, "
                "each with a camera of its own"
            )
        axes = frame[1:]
        # np.allclose takes ten times as long, and there is a camera for every frame
        if not np.all(np.abs(axes @ axes.T - _ORTHONORMAL) <= _TOLERANCE):
            raise UserError(f"camera axes must be orthonormal, got {axes.tolist()}")
        limit = math.inf if self.projection is Projection.ORTHOGRAPHIC else math.pi / 2
        if not (math.isfinite(self.extent) and 0 < self.extent <= limit):
            raise UserError(f"camera extent out of range: {self.extent}")
        if self.projection is Projection.PERSPECTIVE and self.extent > WIDEST_PINHOLE:
            raise UserError(
                f"a pinhole's half field must be at most {WIDEST_PINHOLE:.4f} radians, "
                f"got {self.extent}; an equidistant lens sees more"
            )
        if self.width < 1 or self.height < 1:
            raise UserError(f"picture size must be positive: {self.width, self.height}")
        frame.flags.writeable = False
        object.__setattr__(self, "frame", frame)
        object.__setattr__(self, "projection", Projection(self.projection))
        self._require_rising()

    def _require_rising(self) -> None:
        """Raise UserError where a distorted lens turns back within its field."""
        if self.distortion.is_none:
            return
        if self.projection is Projection.ORTHOGRAPHIC:
            raise UserError("an orthographic view has no lens to be distorted")
        if not self.edge < self.distortion.fold:
            pinhole = self.projection is Projection.PERSPECTIVE
            fold = self.distortion.fold
            fold = math.atan(fold) if pinhole else fold
            raise UserError(
                f"a lens with {self.distortion} folds at {fold:.4g} rad from its axis; "
                f"the half field must be less, got {self.extent:.4g}"
            )

    @property
    def edge(self) -> float:
        """Return the undistorted radius on the half of the shorter side.

        A tangent (pinhole), radians (equidistant) or mm (orthographic).
        """
        if self.projection is Projection.PERSPECTIVE:
            return math.tan(self.extent)
        return self.extent

    @property
    def pixels_per_unit(self) -> float:
        """Return the picture's pixels per tangent, radian or mm, in its middle."""
        edge = self.edge
        if not self.distortion.is_none:
            edge = float(self.distortion.of(np.array(edge)))
        return min(self.width, self.height) / 2 / edge

    @property
    def widest(self) -> float:
        """Return the undistorted radius of the ray farthest from the axis."""
        half = min(self.width, self.height) / 2
        r = 1 + STOP_MARGIN_PX / half
        if self.projection is not Projection.EQUIDISTANT:
            r = math.hypot(self.width, self.height) / 2 / half
        found = float(
            self.distortion.inverse(np.array(r * half) / self.pixels_per_unit)
        )
        return found if math.isfinite(found) else self.distortion.fold

    @property
    def key(self) -> tuple[object, ...]:
        """Return something that is equal exactly for cameras with the same rays."""
        lens = self.extent, self.width, self.height, self.projection, self.distortion
        return self.frame.tobytes(), *lens

    @classmethod
    def looking_at(
        cls,
        eye_mm: ArrayLike,
        target_mm: ArrayLike,
        *,
        up: ArrayLike = (0.0, 0.0, 1.0),
        extent: float = math.radians(44.0),
        size: tuple[int, int] = (512, 512),
        projection: Projection = Projection.EQUIDISTANT,
        distortion: Distortion = NO_DISTORTION,
        right_before: ArrayLike | None = None,
    ) -> "Camera":
        """Aim from `eye_mm` at `target_mm`; `up` need only be roughly upwards.

        size: ``(width, height)`` in pixels. right_before: of a camera that this one
        comes after; see `aimed` for an up that is parallel to the view.
        """
        frame = aimed(eye_mm, target_mm, up, right_before)
        return cls(frame, extent, size[0], size[1], projection, distortion)

    @property
    def eye_mm(self) -> NDArray[np.float64]:
        """Return the eye's world position ``(3,)``."""
        eye: NDArray[np.float64] = self.frame[0]
        return eye

    @property
    def radians_per_pixel(self) -> float:
        """Return the angle of one pixel at the centre (mm per pixel, orthographic)."""
        if not self.distortion.is_none:
            return 1 / self.pixels_per_unit
        return 2 * self.edge / min(self.width, self.height)

    def lens_table(self) -> NDArray[np.float32]:
        """Return camera-frame ray directions ``(height, width, 3)``, read-only.

        Unit vectors, exactly zero outside the round stop of an equidistant lens.
        Orthographic: (x, y) is the ray origin's offset in mm along right and up and
        z is 1. The table is cached; it depends on the lens and the size only.
        """
        return _lens_table(
            self.projection, self.extent, self.width, self.height, self.distortion
        )

    def rays(
        self, where: NDArray[np.bool_] | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return world origins and unit directions, both ``(height, width, 3)``.

        Directions are zero where the lens sees nothing. where: ``(height, width)``, the
        pixels whose rays are given in their order, ``(n, 3)``; None for all.
        """
        table = self.lens_table()
        table = (table if where is None else table[where]).astype(np.float64)
        if self.projection is Projection.ORTHOGRAPHIC:
            offset = table[..., :2] @ self.frame[1:3]
            origins = self.frame[0] + offset
            return origins, np.broadcast_to(self.frame[3], origins.shape).copy()
        directions = table @ self.frame[1:]
        length = np.linalg.norm(directions, axis=-1, keepdims=True)
        np.divide(directions, length, out=directions, where=length > 0)
        return np.broadcast_to(self.frame[0], directions.shape).copy(), directions

    def project(
        self, points_mm: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return pixel positions ``(..., 2)`` (column, row) and distances ``(...)``.

        The centre of pixel (row i, column j) is (j + .5, i + .5). The distance is
        along the ray (along the view axis, orthographic); points behind a pinhole
        get a NaN position, as do those beyond where a distorted lens would fold.
        """
        local = (np.asarray(points_mm, dtype=np.float64) - self.frame[0]) @ self.frame[
            1:
        ].T
        x, y, z = local[..., 0], local[..., 1], local[..., 2]
        half = min(self.width, self.height) / 2
        rho = np.hypot(x, y)
        if self.projection is Projection.ORTHOGRAPHIC:
            scale, distance = np.full_like(z, half / self.extent), z
        elif self.projection is Projection.PERSPECTIVE:
            with np.errstate(divide="ignore", invalid="ignore"):
                scale = np.where(z > 0, half / (z * math.tan(self.extent)), np.nan)
            distance = np.sqrt(rho**2 + z**2)
        else:
            theta = np.arctan2(rho, z)
            near_axis = rho < 1e-12
            safe = np.where(near_axis, 1.0, rho)
            slope = np.where(near_axis, 1 / np.maximum(np.abs(z), 1e-12), theta / safe)
            scale = slope * half / self.extent
            distance = np.sqrt(rho**2 + z**2)
        if not self.distortion.is_none:
            scale = scale * self._bent(rho, z)
        column = self.width / 2 + x * scale
        row = self.height / 2 - y * scale
        return np.stack([column, row], axis=-1), distance

    def _bent(
        self, rho: NDArray[np.float64], z: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return how much farther from the middle a distorted lens puts a point."""
        u = np.arctan2(rho, z)
        if self.projection is Projection.PERSPECTIVE:
            with np.errstate(divide="ignore", invalid="ignore"):
                u = np.where(z > 0, rho / z, np.nan)
        edge = float(self.distortion.stretch(np.array(self.edge)))
        return (
            np.where(u < self.distortion.fold, self.distortion.stretch(u), np.nan)
            / edge
        )

    def with_size(self, width: int, height: int) -> "Camera":
        """Return the same view at another picture size."""
        return replace(self, width=width, height=height)

    def moved(self, frame: NDArray[np.float64]) -> "Camera":
        """Return the same lens at another place."""
        return replace(self, frame=frame)
