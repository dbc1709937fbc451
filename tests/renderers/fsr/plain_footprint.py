"""The Gaussian footprint, and sheets of them, in float64."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.footprint import CUT, SIGMA_PER_SPACING

_EDGE = float(np.exp(-0.5 * CUT**2))
_PHASES = 12
_PEAKS = 256


def gaussian_footprint(r2: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weigh squared distances in sigmas: one at the centre, zero from the cut on."""
    weight = (np.exp(-0.5 * np.asarray(r2, dtype=np.float64)) - _EDGE) / (1 - _EDGE)
    return np.maximum(weight, 0.0)


@lru_cache(maxsize=4)
def sheet_opacities(sigma: float = SIGMA_PER_SPACING) -> NDArray[np.float64]:
    """Return the mean opacity of a sheet for peaks 0..1 in 256 even steps.

    The sheet is an infinite unit lattice of footprints of `sigma`, blended one by
    one; the mean is over one cell, midpoint rule on 12 x 12 phases.
    """
    phase = (np.arange(_PHASES) + 0.5) / _PHASES
    reach = np.arange(-int(CUT * sigma) - 1, int(CUT * sigma) + 2)
    d2 = (phase[:, None] - reach) ** 2
    r2 = (d2[:, None, :, None] + d2[None, :, None, :]) / sigma**2
    weights = gaussian_footprint(r2).reshape(_PHASES**2, -1)
    peaks = np.linspace(0, 1, _PEAKS)
    clear = np.prod(1 - peaks[:, None, None] * weights, axis=-1)
    return np.asarray(1 - clear.mean(axis=1))
