"""MR-like volumes of a phantom: T1 and T2 weighted."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from anatomy.phantom.ct_noise import white_noise
from anatomy.phantom.phantom import Phantom
from anatomy.tissue import TISSUE_OF, TISSUES
from renderers.scene.volume import Volume
from system import UserError

BLUR_MM = 0.38
"""Standard deviation of a 0.9 mm voxel's response."""
BIAS = 0.15
"""Largest deviation of the coil's sensitivity from its mean."""


def magnetic_resonance(phantom: Phantom, noise: float = 0.02) -> tuple[Volume, Volume]:
    """Make T1 and T2 weighted volumes, float32 in 0 to about 1.

    Spin-echo weights of the labels, with bone by its cover; blurred to 0.9 mm, with a
    smooth bias field and Rician noise of standard deviation `noise`. Flowing
    blood and bone are dark.
    """
    if not 0.0 <= noise <= 0.5:
        raise UserError(f"the MR noise must lie in [0, 0.5], got {noise}")
    found = []
    labels, cover = phantom.labels.values, phantom.bone_cover.values
    bias = _bias(phantom.labels)
    thin = TISSUES["thin bone"]
    for number, name in enumerate(("t1", "t2")):
        table = np.zeros(256, dtype=np.float32)
        for label, tissue in TISSUE_OF.items():
            table[label] = getattr(tissue, name)
        signal = table[labels]
        # A thin wall takes its share of a voxel that it does not name.
        share = cover.astype(np.float32) / 255
        thinner = (signal > 0.1) & (cover < 255)
        signal = np.where(
            thinner, signal + share * (getattr(thin, name) - signal), signal
        )
        signal = ndimage.gaussian_filter(signal, BLUR_MM / phantom.spacing_mm)
        signal *= bias
        found.append(_rician(phantom, signal, noise, number))
    h = np.full(3, phantom.spacing_mm)
    first, second = (Volume(v, h, phantom.ct.origin_mm, background=0) for v in found)
    return first, second


def _bias(volume: Volume) -> NDArray[np.float32]:
    """Return a coil's sensitivity: a slow wave along each axis."""
    field = np.ones(volume.shape, dtype=np.float32)
    for axis, period in ((0, 160.0), (1, 210.0), (2, 180.0)):
        n = volume.shape[axis]
        at = volume.origin_mm[2 - axis] + volume.spacing_mm[2 - axis] * np.arange(n)
        wave = 1 + BIAS / 3 * np.sin(2 * np.pi * at / period + axis)
        field *= wave.astype(np.float32).reshape(
            [-1 if a == axis else 1 for a in range(3)]
        )
    return field


def _rician(
    phantom: Phantom, signal: NDArray[np.float32], noise: float, number: int
) -> NDArray[np.float32]:
    h = phantom.spacing_mm
    first = np.round(phantom.ct.origin_mm / h).astype(np.int64)
    seed = 4 * phantom.parameters.seed + 2 * number
    shape = (signal.shape[0], signal.shape[1], signal.shape[2])
    real = signal + np.float32(noise) * white_noise(first, shape, seed)
    other = np.float32(noise) * white_noise(first, shape, seed + 1)
    magnitude: NDArray[np.float32] = np.sqrt(real * real + other * other)
    return magnitude
