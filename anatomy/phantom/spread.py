"""How a head's places differ from the average one's: not only by its size.

A smooth field moves everything together, so that what touches goes on touching: a sum
of `WAVES` waves drawn by the seed, whose covariance falls with the square of the
distance over `REACH_MM`. The anterior nasal spine stays, and nothing leaves the middle
plane, by which left and right are told; else the sides differ as they come.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from anatomy.frame import lps_from_ras
from anatomy.kernels.displace import displace
from anatomy.phantom.lattice import Box
from anatomy.phantom.parameters import PhantomParameters

WAVES = 12
REACH_MM = 30.0
MIDDLE_MM = 9.0
"""Half width over which sideways moves fade towards the middle plane."""

MOST_MM = 8.0
"""Nothing moves farther."""

STEEPEST = 0.6
"""Change of the move over a millimetre, at most; where it is more all is weakened."""

_MARKS_RAS = np.array([[9.0, -33.7, 38.2], [11.5, -42.9, 48.6], [3.6, -54.0, 34.5]])
_SEEN_MM = np.array([[38.6, 59.8], [51.3, 73.5], [50.4, 73.6]])
"""The basal lamella, the skull base behind it and the sphenoid's face, and how far 140
CTs had them from the spine: a spread that leads beyond, less 2 mm for heads of which
other parts vary, too, is weakened."""

_BOX_MM = ((-45.0, 45.0), (-85.0, 25.0), (-15.0, 80.0))


@lru_cache(maxsize=8)
def spread_waves(parameters: PhantomParameters) -> NDArray[np.float32]:
    """Return a head's table for `displace`; no rows for an average one."""
    if not parameters.spread_mm:
        return np.zeros((0, 7), np.float32)
    rng = np.random.default_rng([parameters.seed, 0x73707264])
    waves = np.zeros((1 + WAVES, 7), np.float32)
    waves[0, 3] = 1 / MIDDLE_MM
    vectors = np.clip(rng.standard_normal((WAVES, 3)), -2, 2)
    waves[1:, :3] = vectors / (2 * np.pi * REACH_MM)
    waves[1:, 3] = rng.random(WAVES)
    amplitude = parameters.spread_mm * np.sqrt(2 / WAVES)
    waves[1:, 4:] = amplitude * np.clip(rng.standard_normal((WAVES, 3)), -2, 2)
    while True:
        waves[0, :3] = 0
        # at the spine sideways moves have faded, whatever they are
        still = waves.copy()
        still[0, 3] = 1e6
        spine = np.full((3, 1), 1e-3, np.float32)
        displace(spine, 1, still)
        waves[0, :3] = -spine[:, 0]
        steep, far = _steepest(waves)
        excess = max(steep / STEEPEST, far / MOST_MM)
        roof = np.array([0.0, 0.0, parameters.roof_mm])
        marks = unmoved(_MARKS_RAS + roof, waves)
        seen = parameters.head_scale * np.linalg.norm(marks, axis=1)
        low, high = _SEEN_MM.T
        if np.any((seen < low + 2) | (seen > high - 2)):
            excess = max(excess, 1.1)
        if excess <= 1 or np.abs(waves[1:, 4:]).max() < 0.05:
            return waves
        waves[1:, 4:] *= np.float32(0.98 / excess)


def steepness(waves: NDArray[np.float32]) -> float:
    """Return how much faster than the point its place in the average head moves."""
    return 1.1 * _steepest(waves)[0] if len(waves) else 0.0


def _steepest(waves: NDArray[np.float32]) -> tuple[float, float]:
    """Return the most that the move changes over a millimetre, and the most, mm."""
    axes = [np.arange(low, high, 4.0) for low, high in _BOX_MM]
    points = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)
    moves = moved(points.T, waves) - points.T
    change = np.empty((len(moves), 3, 3))
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 0.5
        ahead = moved(points.T + step, waves) - points.T - step
        change[:, :, axis] = (ahead - moves) / 0.5
    norms = np.linalg.norm(change, ord=2, axis=(1, 2))
    return float(norms.max()), float(np.linalg.norm(moves, axis=1).max())


def moved(
    points: NDArray[np.floating], waves: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Return where ``(n, 3)`` RAS points, mm, lie in the average head."""
    block = np.ascontiguousarray(points.T, np.float32)
    displace(block, block.shape[1], waves)
    return block.T.astype(np.float64)


def around_spread(field_mm: Box, head_scale: float, waves: NDArray[np.float32]) -> Box:
    """Return LPS ranges that hold what ranges of the average head do."""
    if not len(waves):
        return field_mm
    faces = np.array(field_mm)
    axes = [np.linspace(low, high, 12) for low, high in field_mm]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    on_face = np.any((points == faces[:, 0]) | (points == faces[:, 1]), axis=1)
    places = lps_from_ras(points[on_face]) / head_scale
    found = head_scale * lps_from_ras(unmoved(places, waves))
    low, high = found.min(axis=0).tolist(), found.max(axis=0).tolist()
    return (low[0], high[0]), (low[1], high[1]), (low[2], high[2])


def unmoved(
    places: NDArray[np.float64], waves: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Return the ``(n, 3)`` RAS points, mm, that lie at places of the average head."""
    points = places.copy()
    for _ in range(60 if len(waves) else 0):
        error = moved(points, waves) - places
        points -= error
        if np.abs(error).max() < 1e-4:
            break
    return points
