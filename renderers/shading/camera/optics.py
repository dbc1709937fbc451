"""What a camera of one size does to light, as the tables its kernels take."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.shading.camera.camera_settings import CameraSettings, field_tables

_DESIGN_PX = 480.0
"""Picture size the blur widths are given for; they grow with the picture."""


@dataclass(frozen=True, slots=True)
class Lateral:
    """Where a colour channel is read: first column or row, and the part of the next."""

    index: NDArray[np.int32]
    part: NDArray[np.float32]

    @classmethod
    def scaled(cls, size: int, scale: float) -> "Lateral":
        """Read an image of `size` pixels `scale` times as far from its middle."""
        middle = (size - 1) / 2
        at = np.clip((np.arange(size) - middle) * scale + middle, 0, size - 1)
        index = np.minimum(at.astype(np.int32), size - 2).astype(np.int32)
        return cls(index, (at - index).astype(np.float32))

    def runs(self) -> NDArray[np.int32]:
        """Give stretches of equal shift ``(n, 3)``: first, past the last, shift."""
        shift = self.index - np.arange(len(self.index))
        edges = np.flatnonzero(np.diff(shift)) + 1
        first = np.concatenate([[0], edges])
        past = np.concatenate([edges, [len(shift)]])
        runs = np.stack([first, past, shift[first]], axis=1)
        return np.ascontiguousarray(runs, dtype=np.int32)


@dataclass(frozen=True, slots=True, eq=False)
class Optics:
    """Hold the tables of one camera and picture size.

    red, blue: lateral colour along columns and along rows. soft_taps: the centre and
    one side of the first Gaussian of defocus; rest_taps: of what the second adds to
    it, `spacing` pixels apart. halo_taps: of the halo at a quarter of the size.
    vignette, stop: ``(h, w)`` factors. tone: as the kernels number its columns.
    """

    width: int
    height: int
    red: tuple[Lateral, Lateral]
    blue: tuple[Lateral, Lateral]
    soft_taps: NDArray[np.float32]
    rest_taps: NDArray[np.float32]
    spacing: int
    halo_taps: NDArray[np.float32]
    vignette: NDArray[np.float32]
    stop: NDArray[np.float32]
    tone: NDArray[np.float32]

    @property
    def has_bloom(self) -> bool:
        """Say whether what exceeds white spreads."""
        return bool(self.tone[-2:].any())

    @property
    def has_defocus(self) -> bool:
        """Say whether anything is out of focus."""
        return bool(self.tone[1] > 0)


@lru_cache(maxsize=4)
def make_optics(
    settings: CameraSettings, extent: float, width: int, height: int
) -> Optics:
    """Set up the tables for a lens of `extent` radians from axis to stop."""
    scale = min(height, width) / _DESIGN_PX
    red, blue = (
        (Lateral.scaled(width, size), Lateral.scaled(height, size))
        # a larger red image reads each pixel nearer the centre, and vice versa
        for size in (1 + settings.lateral, 1 - settings.lateral)
    )
    soft, softer = settings.soft_px * scale, settings.softer_px * scale
    # the second Gaussian continues from the first; two pixels between taps are close
    # enough, since the first has removed what would alias
    rest = math.sqrt(softer**2 - soft**2)
    spacing = max(1, round(1.1 * rest / 0.95))
    spacing = min(spacing, max(1, round(2 * soft)))
    # averaging 4 x 4 and interpolating back is already a Gaussian of 2 px
    halo = math.sqrt(max((settings.halo_px * scale) ** 2 - 4.0, 0.01)) / 4
    tone = np.array(
        [
            6 / settings.focus_mm,
            settings.defocus_px * scale,
            soft,
            softer,
            settings.stray,
            settings.contrast,
            (1 - settings.contrast) * math.log2(0.18),
            settings.saturation,
            min(settings.knee, 1 - 1e-6),
            settings.keep_hue,
            settings.noise**2,
            settings.noise_floor,
            settings.glare,
            settings.halo,
        ],
        np.float32,
    )
    return Optics(
        width,
        height,
        red,
        blue,
        _gaussian(soft, 1),
        _gaussian(rest, spacing),
        spacing,
        _gaussian(halo, 1),
        *field_tables(settings, extent, width, height),
        tone,
    )


def _gaussian(sigma_px: float, spacing: int) -> NDArray[np.float32]:
    """Give the centre tap and one side of a normalised Gaussian."""
    reach = max(1, math.ceil(2.2 * sigma_px / spacing))
    taps = np.exp(-0.5 * (np.arange(reach + 1) * spacing / sigma_px) ** 2)
    taps /= taps[0] + 2 * taps[1:].sum()
    return taps.astype(np.float32)
