"""What a renderer found behind each pixel, before any light falls on it.

Both renderers end in this; one shading kernel lights it. That is what makes the
splatter and the ray caster agree: measured on the nasal cavity, splats coloured one
by one reach an SSIM of .83-.98 against the ray caster, splats shaded through this
buffer .96-.999, because vessels and highlights are finer than a splat.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Kind = TypeVar("Kind", bound=np.generic)


class Material(IntEnum):
    """Name what a pixel shows. TISSUE takes its colour from the blood volume.

    The last four are laid open by cuts; shading finds them in pixels of TISSUE.
    """

    TISSUE = 0
    METAL = 1
    DARK_PLASTIC = 2
    BLOOD = 3
    MUCUS = 4
    POLYP = 5
    BONE = 6
    RAW_FLESH = 7
    BONE_EDGE = 8
    CUT_BONE = 9
    DEEP_TISSUE = 10


TOOLS = (Material.METAL, Material.DARK_PLASTIC)
"""What tools are made of, and tissue is not."""


def read_only(array: NDArray[Kind]) -> NDArray[Kind]:
    """View an array, C-ordered, so that it cannot be written.

    Writable and read-only arrays are different types to a compiled kernel, which would
    be compiled for both.
    """
    if array.flags.c_contiguous and not array.flags.writeable:
        return array
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


@dataclass(frozen=True, slots=True)
class GBuffer:
    """One picture's geometry; row 0 at the top.

    depth_mm: ``(h, w)`` float32, distance along the pixel's unit ray; +inf where
        nothing was met.
    normal: ``(h, w, 3)`` float32, unit, world frame, towards the air.
    coverage: ``(h, w)`` float32 in 0..1; zero exactly where depth is infinite.
    material: ``(h, w)`` uint8, a `Material`.
    The surface point is ``origin + depth * ray`` with the camera's own rays; it is
    never stored, so that it cannot disagree with them.
    """

    depth_mm: NDArray[np.float32]
    normal: NDArray[np.float32]
    coverage: NDArray[np.float32]
    material: NDArray[np.uint8]

    def __post_init__(self) -> None:
        shape = self.depth_mm.shape
        for name, array, expected, dtype in (
            ("depth_mm", self.depth_mm, shape, np.float32),
            ("normal", self.normal, (*shape, 3), np.float32),
            ("coverage", self.coverage, shape, np.float32),
            ("material", self.material, shape, np.uint8),
        ):
            if array.shape != expected or array.dtype != dtype or len(shape) != 2:
                raise ValueError(
                    f"G-buffer {name} must be {dtype.__name__} of shape {expected}, "
                    f"got {array.dtype} {array.shape}"
                )

    @classmethod
    def empty(cls, height: int, width: int) -> "GBuffer":
        """Return a buffer that shows nothing; its arrays may be filled in place."""
        return cls(
            np.full((height, width), np.inf, np.float32),
            np.zeros((height, width, 3), np.float32),
            np.zeros((height, width), np.float32),
            np.zeros((height, width), np.uint8),
        )

    @property
    def size(self) -> tuple[int, int]:
        """Return ``(height, width)``."""
        height, width = self.depth_mm.shape
        return height, width

    def read_only(self) -> "GBuffer":
        """View the arrays so that they cannot be written."""
        return GBuffer(
            read_only(self.depth_mm),
            read_only(self.normal),
            read_only(self.coverage),
            read_only(self.material),
        )

    def every(self, step: int) -> "GBuffer":
        """Return every so many-th pixel of every so many-th row."""
        here = slice(None, None, step), slice(None, None, step)
        return GBuffer(
            np.ascontiguousarray(self.depth_mm[here]),
            np.ascontiguousarray(self.normal[here]),
            np.ascontiguousarray(self.coverage[here]),
            np.ascontiguousarray(self.material[here]),
        )

    def nearest(self, other: "GBuffer") -> "GBuffer":
        """Merge with another buffer of the same view: the nearer surface wins."""
        if other.size != self.size:
            raise ValueError(f"cannot merge pictures of {self.size} and {other.size}")
        front = other.depth_mm < self.depth_mm
        return GBuffer(
            np.where(front, other.depth_mm, self.depth_mm),
            np.where(front[..., None], other.normal, self.normal),
            np.where(front, other.coverage, self.coverage),
            np.where(front, other.material, self.material),
        )
