"""What a camera of one size does to light, as the tables its kernels take."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.shading.camera.camera_settings import CameraSettings
from renderers.shading.camera.field_stop import field_tables
from renderers.shading.kernels.camera_expose import Lateral, W

_DESIGN_PX = 480.0
"""Picture size the blur widths are given for; they grow with the picture."""


def scaled_axis(
    size: int, scale: float
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return where pixels of an axis read an image `scale` times as large.

    The first of two source pixels, and the part of the second.
    """
    middle = (size - 1) / 2
    at = np.clip((np.arange(size) - middle) * scale + middle, 0, size - 1)
    index = np.minimum(at.astype(np.int32), size - 2).astype(np.int32)
    return index, (at - index).astype(np.float32)


def runs_of(index: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return stretches of equal shift ``(n, 3)``: first, past the last, shift."""
    shift = index - np.arange(len(index))
    edges = np.flatnonzero(np.diff(shift)) + 1
    first = np.concatenate([[0], edges])
    past = np.concatenate([edges, [len(shift)]])
    return np.stack([first, past, shift[first]], axis=1).astype(np.int32)


def lateral_colour(width: int, height: int, scale: float) -> Lateral:
    """Return the tables of a colour channel read `scale` times as far from the axis."""
    index, part = scaled_axis(width, scale)
    # the last vector of a run may begin at its last pixel
    part = np.concatenate([part, np.zeros(W, np.float32)])
    return Lateral(runs_of(index), part, *scaled_axis(height, scale))


@dataclass(frozen=True, slots=True, eq=False)
class Optics:
    """The tables of one camera and picture size.

    red, blue: lateral colour. soft_taps: the centre and
    one side of the first Gaussian of defocus; rest_taps: of what the second adds to
    it, `spacing` pixels apart. halo_taps: of the halo at a quarter of the size.
    vignette, stop: ``(h, w)`` factors. tone: as the kernels number its columns.
    """

    width: int
    height: int
    red: Lateral
    blue: Lateral
    soft_taps: NDArray[np.float32]
    rest_taps: NDArray[np.float32]
    spacing: int
    halo_taps: NDArray[np.float32]
    vignette: NDArray[np.float32]
    stop: NDArray[np.float32]
    tone: NDArray[np.float32]

    @property
    def has_bloom(self) -> bool:
        """Return whether what exceeds white spreads."""
        return bool(self.tone[-2:].any())

    @property
    def has_defocus(self) -> bool:
        """Return whether anything is out of focus."""
        return bool(self.tone[1] > 0)


@lru_cache(maxsize=12)
def make_optics(
    settings: CameraSettings, extent: float, width: int, height: int
) -> Optics:
    """Set up the tables for a lens of `extent` radians from axis to stop."""
    scale = min(height, width) / _DESIGN_PX
    red, blue = (
        lateral_colour(width, height, size)
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
    """Return the centre tap and one side of a normalised Gaussian."""
    reach = max(1, math.ceil(2.2 * sigma_px / spacing))
    taps = np.exp(-0.5 * (np.arange(reach + 1) * spacing / sigma_px) ** 2)
    taps /= taps[0] + 2 * taps[1:].sum()
    return taps.astype(np.float32)
