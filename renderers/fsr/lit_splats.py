"""Splats lit as mode `classic` lights them, for who blends them elsewhere."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.fuzzy_set import FuzzySet
from renderers.fsr.splats.peak_opacity import DEEPEST, PEAK
from renderers.scene import Scene

_PEAK = np.polynomial.Polynomial([0.0, *PEAK])


def splat_peaks(depth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give how opaque the centres of splats are that stand for optical depths."""
    peaks = _PEAK(np.minimum(depth, float(DEEPEST)))
    return np.clip(np.asarray(peaks, dtype=np.float64), 0.0, 1.0)


def lit_splats(fuzzy_set: FuzzySet, scene: Scene) -> NDArray[np.float64]:
    """Give a set's colours and peaks, ``(n, 4)``: linear RGB and alpha, not multiplied.

    Ambient and diffuse light of all the scene's lights; a splat without a normal is not
    shaded. A peak is what gives a sheet of such splats one voxel's opacity.
    """
    color, kappa = scene.transfer_function.evaluate(fuzzy_set.value.astype(np.float64))
    normal = fuzzy_set.normals().astype(np.float64)
    light = scene.diffuse_light(normal, fuzzy_set.rows.centers_mm())
    light[~np.any(normal, axis=1)] = 1.0
    length_mm = float(np.prod(scene.volume.spacing_mm) ** (1 / 3))
    return np.column_stack([color * light, splat_peaks(kappa * length_mm)])
