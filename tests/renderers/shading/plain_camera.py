"""The camera's picture in plain numpy, one stage after the other."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from renderers.scene import srgb_from_linear
from renderers.shading.camera.grain import SIDE, grain_offset, grain_tile
from renderers.shading.camera.optics import Optics
from renderers.shading.kernels.camera_expose import Lateral

Doubles = NDArray[np.float64]


def picture_of(
    optics: Optics,
    seed: int,
    radiance: NDArray[np.float32],
    depth_mm: NDArray[np.float32],
    gain: float,
    frame_number: int,
) -> NDArray[np.uint8]:
    """Give what `Developer.expose` makes, but for rounding."""
    sharp = exposed(optics, radiance, gain)
    if optics.has_bloom:
        sharp += bloom(optics, sharp)
    mixed = sharp
    if optics.has_defocus:
        soft = blurred(sharp, optics.soft_taps, 1)
        softer = blurred(soft, optics.rest_taps, optics.spacing)
        focus, defocus, smallest, widest = optics.tone[:4].astype(float)
        out_of = np.abs(focus - 6 / np.maximum(depth_mm.astype(float), 0.05))
        radius = defocus * np.maximum(out_of - 0.12, 0)[..., None]
        near = np.maximum(1 - radius / smallest, 0)
        far = np.clip((radius - smallest) / (widest - smallest), 0, 1)
        mixed = near * sharp + (1 - near - far) * soft + far * softer
    stray, contrast, pivot, saturation, knee, keep, noise2, floor = optics.tone[
        4:12
    ].astype(float)
    c = mixed * optics.vignette[..., None] + stray
    c = np.where(c > 0, c**contrast, 0) * 2**pivot
    grey = (c @ np.array([0.2126, 0.7152, 0.0722]))[..., None]
    c = np.maximum(grey + saturation * (c - grey), 0)
    c = shouldered(c, knee, keep)
    row, column = grain_offset(frame_number)
    i = (np.arange(optics.height) + row) % SIDE
    j = (np.arange(optics.width) + column) % SIDE
    grain = np.moveaxis(grain_tile(seed)[:, i[:, None], j], 0, 2)
    c = c + grain * np.sqrt(noise2 * (floor + c))
    c = np.clip(c * optics.stop[..., None], 0, 1)
    codes: NDArray[np.uint8] = (255 * srgb_from_linear(c) + 0.5).astype(np.uint8)
    return codes


def exposed(optics: Optics, radiance: NDArray[np.float32], gain: float) -> Doubles:
    """Apply gain and lateral colour."""
    green = gain * radiance[..., 1].astype(float)
    channels = [green, green, green]
    for channel, lateral in ((0, optics.red), (2, optics.blue)):
        source = gain * radiance[..., channel].astype(float)
        column, part = sources(lateral), lateral.part[: optics.width].astype(float)
        source = source[:, column] * (1 - part) + source[:, column + 1] * part
        row, part = lateral.row, lateral.row_part.astype(float)[:, None]
        channels[channel] = source[row] * (1 - part) + source[row + 1] * part
    return np.stack(channels, axis=-1)


def sources(lateral: Lateral) -> NDArray[np.int64]:
    """Give the source column of every pixel."""
    return np.concatenate([np.arange(a, b) + shift for a, b, shift in lateral.runs])


def bloom(optics: Optics, sharp: Doubles) -> Doubles:
    """Spread what exceeds white, on a quarter of the size."""
    rows, columns = -(-optics.height // 4), -(-optics.width // 4)
    excess = np.zeros((4 * rows, 4 * columns, 3))
    excess[: optics.height, : optics.width] = np.clip(sharp - 1, 0, 3)
    small = excess.reshape(rows, 4, columns, 4, 3).mean(axis=(1, 3))
    glare, halo = optics.tone[-2:].astype(float)
    small = glare * small + halo * blurred(small, optics.halo_taps, 1)
    # centres of small pixels lie at 4 i + 1.5
    for axis, size in ((0, optics.height), (1, optics.width)):
        at = np.clip((np.arange(size) - 1.5) / 4, 0, small.shape[axis] - 1)
        low = np.minimum(at.astype(int), small.shape[axis] - 2)
        part = (at - low).reshape([-1 if k == axis else 1 for k in range(3)])
        first, second = small.take(low, axis), small.take(low + 1, axis)
        small = first + part * (second - first)
    result: Doubles = small
    return result


def blurred(planes: Doubles, taps: NDArray[np.float32], spacing: int) -> Doubles:
    """Blur along rows and columns; the outermost pixels repeat."""
    kernel = np.zeros(2 * (len(taps) - 1) * spacing + 1)
    kernel[::spacing] = [*taps[:0:-1], *taps]
    for axis in (1, 0):
        planes = correlate1d(planes, kernel, axis=axis, mode="nearest")
    return planes


def shouldered(c: Doubles, knee: float, most: float) -> Doubles:
    """Bend highlights below one; a share of it keeps the hue."""

    def bend(value: Doubles) -> Doubles:
        over = np.maximum(value - knee, 0)
        bent = knee + (1 - knee) * over / (1 - knee + over)
        return np.where(value > knee, bent, value)

    top = c.max(axis=-1, keepdims=True)
    some = np.maximum(top, 1e-6)
    keep = most * np.minimum(2 * (top - c.min(axis=-1, keepdims=True)) / some, 1)
    result: Doubles = keep * bend(top) / some * c + (1 - keep) * bend(c)
    return result
