"""Seven rays of 3 mm whose emission-absorption integrals have closed forms."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LENGTH = 3.0
F64 = NDArray[np.float64]
Along = Callable[[F64], F64]


@dataclass(frozen=True)
class Ray:
    """What lies along a ray, and the light and transmittance it ends with."""

    kappa: Along
    color: Along
    light: float
    clear: float
    jump: float | None = None


def constant(value: float) -> Along:
    return lambda s: np.full_like(s, value)


def two(before: float, after: float) -> Along:
    return lambda s: np.where(s < 1.2345, before, after)


RAYS = {
    "constant": Ray(constant(0.8), constant(1.0), 0.909282046710588, 0.090717953289412),
    "linear extinction": Ray(
        lambda s: 0.1 + 0.5 * s, constant(1.0), 0.921918333998847, 0.078081666001153
    ),
    "exponential extinction": Ray(
        lambda s: 2 * np.exp(-s / 0.7),
        constant(1.0),
        0.748605207885039,
        0.251394792114961,
    ),
    "Gaussian extinction": Ray(
        lambda s: 1.5 * np.exp(-(0.25**2 + (s - 1.4) ** 2) / (2 * 0.4**2)),
        constant(1.0),
        0.709691384275370,
        0.290308615724630,
    ),
    "linear colour": Ray(
        constant(0.8), lambda s: 0.2 + 0.25 * s, 0.397968583972117, 0.090717953289412
    ),
    "cosine colour": Ray(
        constant(0.8),
        lambda s: (1 + np.cos(2.3 * s)) / 2,
        0.512751746814776,
        0.090717953289412,
    ),
    "two layers": Ray(
        two(0.5, 1.7), two(1.0, 0.3), 0.614355865913860, 0.026820198499004, 1.2345
    ),
}
