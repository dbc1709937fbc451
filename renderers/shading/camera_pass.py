"""The camera both renderers' pictures go through: optics, gain, tone, grain, stop."""

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, GBuffer, Projection
from renderers.shading.bands import RowBands
from renderers.shading.camera.kernels import (
    N as BLOCK,
)
from renderers.shading.camera.kernels import (
    add_bloom,
    blur_across,
    blur_along,
    develop_rows,
    expose_rows,
    glare_rows,
)
from renderers.shading.camera_settings import CameraSettings, field_tables
from renderers.shading.exposure import meter

_DESIGN_PX = 480.0
"""Picture size the blur widths are given for; they grow with the picture."""
_GRAIN_SIDE = 256


@dataclass(frozen=True, slots=True)
class _Lateral:
    """Where a colour channel is read: first column or row, and the part of the next."""

    index: NDArray[np.int32]
    part: NDArray[np.float32]

    @classmethod
    def scaled(cls, size: int, scale: float) -> "_Lateral":
        middle = (size - 1) / 2
        at = np.clip((np.arange(size) - middle) * scale + middle, 0, size - 1)
        index = np.minimum(at.astype(np.int32), size - 2).astype(np.int32)
        return cls(index, (at - index).astype(np.float32))


class CameraPass:
    """Turn radiance into the picture on the monitor.

    seed: of the grain. The same radiance, gain and frame number give the same bytes
    for any `threads`.
    """

    def __init__(
        self, settings: CameraSettings | None = None, threads: int = 2, seed: int = 1
    ) -> None:
        self.settings = settings or CameraSettings()
        self._bands = RowBands(threads)
        self._grain = _grain_tile(seed)
        self._buffers = _Buffers()

    def finish(
        self,
        radiance: NDArray[np.float32],
        gbuffer: GBuffer,
        camera: Camera,
        *,
        gain: float | None = None,
        frame_number: int = 0,
    ) -> tuple[NDArray[np.uint8], float]:
        """Give the sRGB picture ``(h, w, 3)`` uint8, and the gain it was exposed with.

        gain: linear factor; None meters this picture (see `exposure.meter`).
        frame_number: picks the grain; pictures of different numbers differ in grain
        only. Not safe to call from two threads at once.
        """
        height, width = camera.height, camera.width
        if radiance.shape != (height, width, 3) or radiance.dtype != np.float32:
            raise ValueError(
                f"radiance must be float32 {(height, width, 3)} for this camera, got "
                f"{radiance.dtype} {radiance.shape}"
            )
        if gbuffer.size != (height, width):
            raise ValueError(
                f"G-buffer of {gbuffer.size} does not fit a camera of {height, width}"
            )
        if camera.projection is not Projection.EQUIDISTANT:
            raise ValueError(
                f"the scope's camera needs an equidistant lens, got "
                f"{camera.projection.name.lower()}"
            )
        if min(height, width) < 8:
            raise ValueError(f"a picture needs at least 8 pixels: {height, width}")
        if gain is None:
            gain = meter(radiance)
        elif not (math.isfinite(gain) and gain > 0):
            raise ValueError(f"a gain is positive and finite, got {gain}")
        frame = _Frame(self.settings, camera, self._bands, self._buffers)
        frame.expose(radiance, gain)
        frame.bloom()
        return frame.develop(gbuffer.depth_mm, self._grain, frame_number), gain

    def close(self) -> None:
        """End the threads."""
        self._bands.close()


@dataclass(slots=True)
class _Buffers:
    """Keep a picture's intermediate planes from frame to frame."""

    planes: list[NDArray[np.float32]] = field(default_factory=list)

    def of(self, height: int, width: int) -> list[NDArray[np.float32]]:
        if not self.planes or self.planes[0].shape != (height, width, 3):
            self.planes = [np.empty((height, width, 3), np.float32) for _ in range(4)]
        return self.planes


class _Frame:
    """Carry one picture through the stages."""

    def __init__(
        self,
        settings: CameraSettings,
        camera: Camera,
        bands: RowBands,
        buffers: _Buffers,
    ) -> None:
        self.settings = settings
        self.height, self.width = camera.height, camera.width
        self.scale = min(self.height, self.width) / _DESIGN_PX
        self.bands = bands
        self.sharp, self.soft, self.softer, self.spare = buffers.of(
            self.height, self.width
        )
        self.vignette, self.stop = field_tables(
            settings, camera.extent, self.width, self.height
        )

    def expose(self, radiance: NDArray[np.float32], gain: float) -> None:
        lateral = self.settings.lateral
        tables = []
        # a larger red image reads each pixel nearer the centre, and vice versa
        for scale in (1 + lateral, 1 - lateral):
            for size in (self.width, self.height):
                table = _Lateral.scaled(size, scale)
                tables.append((table.index, table.part))
        red_column, red_row, blue_column, blue_row = tables
        radiance = np.ascontiguousarray(radiance)

        def rows(first: int, last: int) -> None:
            expose_rows(
                radiance,
                np.float32(gain),
                *red_column,
                *blue_column,
                *red_row,
                *blue_row,
                self.sharp,
                first,
                last,
            )

        self.bands.run(self.height, rows)

    def bloom(self) -> None:
        """Spread what exceeds white; on a quarter of the size, it is smooth."""
        settings = self.settings
        if settings.glare == 0 and settings.halo == 0:
            return
        small = np.empty((-(-self.height // 4), -(-self.width // 4), 3), np.float32)
        glare_rows(self.sharp, small, 0, small.shape[0])
        if not small.any():
            return
        # averaging 4 x 4 and interpolating back is already a Gaussian of 2 px
        sigma = math.sqrt(max((settings.halo_px * self.scale) ** 2 - 4.0, 0.01)) / 4
        taps = _gaussian(sigma, 1)
        once, twice = np.empty_like(small), np.empty_like(small)
        blur_along(small, taps, 1, once, 0, small.shape[0])
        blur_across(once, taps, 1, twice, 0, small.shape[0])
        bloom = np.float32(settings.glare) * small + np.float32(settings.halo) * twice
        self.bands.run(
            self.height,
            lambda first, last: add_bloom(bloom, self.sharp, first, last),
        )

    def develop(
        self,
        depth_mm: NDArray[np.float32],
        grain: NDArray[np.float32],
        frame_number: int,
    ) -> NDArray[np.uint8]:
        settings = self.settings
        soft, softer = settings.soft_px * self.scale, settings.softer_px * self.scale
        if settings.defocus_px > 0:
            self._blur(self.sharp, self.soft, _gaussian(soft, 1), 1)
            # the second Gaussian continues from the first; two pixels between taps
            # are close enough, since the first has removed what would alias
            rest = math.sqrt(softer**2 - soft**2)
            spacing = max(1, round(1.1 * rest / 0.95))
            spacing = min(spacing, max(1, round(2 * soft)))
            self._blur(self.soft, self.softer, _gaussian(rest, spacing), spacing)
        tone = np.array(
            [
                6 / settings.focus_mm,
                settings.defocus_px * self.scale,
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
            ],
            np.float32,
        )
        turn = _hash(frame_number)
        row, column = turn % _GRAIN_SIDE, turn // _GRAIN_SIDE % _GRAIN_SIDE
        depth = np.ascontiguousarray(depth_mm).view()
        depth.flags.writeable = False
        picture = np.empty((self.height, self.width, 3), np.uint8)

        def rows(first: int, last: int) -> None:
            develop_rows(
                self.sharp,
                self.soft if settings.defocus_px > 0 else self.sharp,
                self.softer if settings.defocus_px > 0 else self.sharp,
                depth,
                self.vignette,
                self.stop,
                grain,
                row,
                column,
                tone,
                picture,
                first,
                last,
            )

        self.bands.run(self.height, rows)
        return picture

    def _blur(
        self,
        source: NDArray[np.float32],
        into: NDArray[np.float32],
        taps: NDArray[np.float32],
        spacing: int,
    ) -> None:
        self.bands.run(
            self.height,
            lambda first, last: blur_along(
                source, taps, spacing, self.spare, first, last
            ),
        )
        self.bands.run(
            self.height,
            lambda first, last: blur_across(
                self.spare, taps, spacing, into, first, last
            ),
        )


def _gaussian(sigma_px: float, spacing: int) -> NDArray[np.float32]:
    """Give the centre tap and one side of a normalised Gaussian."""
    reach = max(1, math.ceil(2.2 * sigma_px / spacing))
    taps = np.exp(-0.5 * (np.arange(reach + 1) * spacing / sigma_px) ** 2)
    taps /= taps[0] + 2 * taps[1:].sum()
    return taps.astype(np.float32)


@lru_cache(maxsize=2)
def _grain_tile(seed: int) -> NDArray[np.float32]:
    """Give periodic grain ``(256, 256 + 64, 3)``, unit sd, correlated over .7 px."""
    white = np.random.default_rng(seed).standard_normal((_GRAIN_SIDE, _GRAIN_SIDE, 3))
    k = np.fft.fftfreq(_GRAIN_SIDE)
    blur = np.exp(-2 * (math.pi * 0.7) ** 2 * (k[:, None] ** 2 + k**2))
    smooth = np.fft.ifft2(
        np.fft.fft2(white, axes=(0, 1)) * blur[..., None], axes=(0, 1)
    ).real
    grain = 0.75 * white + smooth
    grain /= grain.std()
    # a block of the kernel may start in the last column
    wrapped = np.concatenate([grain, grain[:, :BLOCK]], axis=1)
    result = np.ascontiguousarray(wrapped, dtype=np.float32)
    result.flags.writeable = False
    return result


def _hash(counter: int) -> int:
    """Mix a counter into 32 well-spread bits (the finaliser of MurmurHash3)."""
    h = (counter + 0x9E3779B9) & 0xFFFFFFFF
    h = ((h ^ (h >> 16)) * 0x85EBCA6B) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 0xC2B2AE35) & 0xFFFFFFFF
    return h ^ (h >> 16)
