"""A picture in linear light, and the one place where it becomes sRGB."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from system import UserError, whole_file


def srgb_from_linear(linear: NDArray[np.floating]) -> NDArray[np.float32]:
    """Encode linear light with the sRGB curve (IEC 61966-2-1); clips to 0..1."""
    c = np.clip(np.asarray(linear, dtype=np.float32), 0, 1)
    low = c * np.float32(12.92)
    high = np.float32(1.055) * c ** np.float32(1 / 2.4) - np.float32(0.055)
    return np.where(c <= 0.0031308, low, high).astype(np.float32)


@dataclass(frozen=True, slots=True)
class Image:
    """Premultiplied linear RGBA, ``(h, w, 4)`` float32, row 0 at the top.

    depth_mm: optional ``(h, w)`` float32 along the rays, +inf where nothing is.
    """

    rgba: NDArray[np.float32]
    depth_mm: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        if self.rgba.ndim != 3 or self.rgba.shape[2] != 4:
            raise UserError(f"an image is (h, w, 4), got {self.rgba.shape}")
        if self.rgba.dtype != np.float32:
            raise UserError(f"an image is float32, got {self.rgba.dtype}")
        depth = self.depth_mm
        if depth is not None and depth.shape != self.rgba.shape[:2]:
            raise UserError(f"depth {depth.shape} does not fit {self.rgba.shape}")

    @property
    def size(self) -> tuple[int, int]:
        """Return ``(height, width)``."""
        return self.rgba.shape[0], self.rgba.shape[1]

    def over(self, background: tuple[float, float, float]) -> NDArray[np.float32]:
        """Return linear RGB ``(h, w, 3)`` in front of a uniform background."""
        rest = 1 - self.rgba[..., 3:4]
        return self.rgba[..., :3] + rest * np.asarray(background, dtype=np.float32)

    def to_srgb8(
        self, background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> NDArray[np.uint8]:
        """Encode for a screen: ``(h, w, 3)`` uint8."""
        encoded = srgb_from_linear(self.over(background))
        return (encoded * 255 + np.float32(0.5)).astype(np.uint8)


def save_png(
    path: Path, pixels: NDArray[np.uint8], text: dict[str, str] | None = None
) -> None:
    """Write ``(h, w)`` or ``(h, w, 3)`` uint8 atomically, with text metadata."""
    from PIL import Image as PngImage
    from PIL.PngImagePlugin import PngInfo

    info = PngInfo()
    for key, value in (text or {}).items():
        info.add_text(key, value)
    with whole_file(path) as beside:
        PngImage.fromarray(pixels).save(beside, format="PNG", pnginfo=info)
