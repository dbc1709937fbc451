"""Where a picture is seen from, and which ray belongs to which pixel.

Camera frame: x right, y up, z forward (along the view axis). Pixel ``(row, column)``
of an ``height x width`` picture is sampled at its centre; row 0 is at the top.
Three projections: the rigid endoscope's *equidistant* lens ``r = f * theta``
(a rigid sinus scope shows 52 % of the size at the edge of its field, Laryngoscope
2015;125:561; theta / tan(theta) is .79 there and cos(theta)**2 .51, so the law needs
no coefficient), the pinhole, and the orthographic view.
"""

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
    projection: Projection, extent: float, width: int, height: int
) -> NDArray[np.float32]:
    half = min(width, height) / 2
    x, y = np.meshgrid(
        (np.arange(width) + 0.5 - width / 2) / half,
        -(np.arange(height) + 0.5 - height / 2) / half,
    )
    table = np.zeros((height, width, 3))
    if projection is Projection.EQUIDISTANT:
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


@dataclass(frozen=True, slots=True)
class Camera:
    """Place an eye and its lens.

    frame: ``(4, 3)`` float64 world rows eye (mm), right, up, forward (unit).
    extent: for EQUIDISTANT and PERSPECTIVE the half field angle in radians that
        falls on the half of the picture's shorter side; for ORTHOGRAPHIC that half
        side in mm.
    width, height: picture size in pixels.
    """

    frame: NDArray[np.float64]
    extent: float
    width: int
    height: int
    projection: Projection = Projection.EQUIDISTANT

    def __post_init__(self) -> None:
        frame = np.array(self.frame, dtype=np.float64)
        if frame.shape != (4, 3) or not np.all(np.isfinite(frame)):
            raise ValueError(f"camera frame must be finite (4, 3), got {frame}")
        axes = frame[1:]
        # np.allclose takes ten times as long, and there is a camera for every frame
        if not np.all(np.abs(axes @ axes.T - _ORTHONORMAL) <= _TOLERANCE):
            raise ValueError(f"camera axes must be orthonormal, got {axes}")
        limit = math.inf if self.projection is Projection.ORTHOGRAPHIC else math.pi / 2
        if not (math.isfinite(self.extent) and 0 < self.extent <= limit):
            raise ValueError(f"camera extent out of range: {self.extent}")
        if self.projection is Projection.PERSPECTIVE and self.extent > WIDEST_PINHOLE:
            raise ValueError(
                f"a pinhole's half field must be at most {WIDEST_PINHOLE:.4f} radians, "
                f"got {self.extent}; an equidistant lens sees more"
            )
        if self.width < 1 or self.height < 1:
            raise ValueError(
                f"picture size must be positive: {self.width, self.height}"
            )
        frame.flags.writeable = False
        object.__setattr__(self, "frame", frame)
        object.__setattr__(self, "projection", Projection(self.projection))

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
    ) -> "Camera":
        """Aim from `eye_mm` at `target_mm`; `up` need only be roughly upwards.

        size: ``(width, height)`` in pixels.
        """
        eye = np.asarray(eye_mm, dtype=np.float64)
        forward = np.asarray(target_mm, dtype=np.float64) - eye
        right = np.cross(forward, np.asarray(up, dtype=np.float64))
        if np.linalg.norm(forward) == 0 or np.linalg.norm(right) < 1e-12:
            raise ValueError(
                f"cannot aim from {eye} at {target_mm!r}: the points coincide or the "
                "view axis is parallel to up"
            )
        forward /= np.linalg.norm(forward)
        right /= np.linalg.norm(right)
        frame = np.stack([eye, right, np.cross(right, forward), forward])
        return cls(frame, extent, size[0], size[1], projection)

    @property
    def eye_mm(self) -> NDArray[np.float64]:
        """Get the eye's world position ``(3,)``."""
        eye: NDArray[np.float64] = self.frame[0]
        return eye

    @property
    def radians_per_pixel(self) -> float:
        """Get the angle of one pixel at the centre (mm per pixel, orthographic)."""
        pinhole = self.projection is Projection.PERSPECTIVE
        half = math.tan(self.extent) if pinhole else self.extent
        return 2 * half / min(self.width, self.height)

    def lens_table(self) -> NDArray[np.float32]:
        """Give camera-frame ray directions ``(height, width, 3)``, read-only.

        Unit vectors, exactly zero outside the round stop of an equidistant lens.
        Orthographic: (x, y) is the ray origin's offset in mm along right and up and
        z is 1. The table is cached; it depends on the lens and the size only.
        """
        return _lens_table(self.projection, self.extent, self.width, self.height)

    def rays(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Give world origins and unit directions, both ``(height, width, 3)``.

        Directions are zero where the lens sees nothing.
        """
        table = self.lens_table().astype(np.float64)
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
        """Give pixel positions ``(..., 2)`` (column, row) and distances ``(...)``.

        The centre of pixel (row i, column j) is (j + .5, i + .5). The distance is
        along the ray (along the view axis, orthographic); points behind a pinhole
        get a NaN position.
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
        column = self.width / 2 + x * scale
        row = self.height / 2 - y * scale
        return np.stack([column, row], axis=-1), distance

    def with_size(self, width: int, height: int) -> "Camera":
        """Return the same view at another picture size."""
        return Camera(self.frame, self.extent, width, height, self.projection)
