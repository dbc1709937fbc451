"""Shadows of the scope's light, source by source."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.shading.kernels.field_reads import DistanceField, Place, sobel_normal
from renderers.shading.kernels.path_tracing import (
    FibreLight,
    direct,
    lifted,
    sphere_trace,
)

f32 = np.float32
FORWARD = np.array([0, 0, 1], np.float32)
SPREAD, EACH = f32(2.8), f32(0.3)


def cave() -> NDArray[np.float32]:
    """Give a ball of air with a pillar across, voxels of a millimetre."""
    z, y, x = np.indices((24, 24, 24)).astype(np.float32) - 11.5
    ball = np.sqrt(x * x + y * y + z * z) - 10
    pillar = 2 - np.hypot(x - 2, z - 1)
    found: NDArray[np.float32] = np.maximum(ball, pillar).astype(np.float32)
    return found


def one_by_one(
    field: DistanceField, at: Place, normal: Place, sources: NDArray[np.float32]
) -> tuple[np.float32, int]:
    """Light a wall as `direct` does, each way looked for by itself."""
    total, shadows = f32(0), 0
    for source in sources:
        x, y, z = (source[c] - at[c] for c in range(3))
        d2 = x * x + y * y + z * z + f32(1e-6)
        d = f32(math.sqrt(d2))
        x, y, z = x / d, y / d, z / d
        facing = normal[0] * x + normal[1] * y + normal[2] * z
        if facing <= 0:
            continue
        above = lifted(field, at, normal)
        if sphere_trace(field, above, (x, y, z), d) >= 0:
            shadows += 1
            continue
        away = f32(1) + (x * FORWARD[0] + y * FORWARD[1] + z * FORWARD[2])
        strength = EACH * f32(math.exp(-SPREAD * max(away, f32(0))))
        total += strength * facing * min(f32(1) / d2, f32(1 / 0.6))
    return total, shadows


@pytest.mark.parametrize("count", [2, 6, 8, 12])
def test_sources_looked_for_together_are_in_shadow_as_each_alone(count: int) -> None:
    """For more of them than are looked for at once, too."""
    distance, m = cave(), np.eye(3, dtype=np.float32)
    eye = np.array([8.0, 11.5, 8.0], np.float32)
    rng = np.random.default_rng(count)
    turn = rng.uniform(0, 2 * np.pi, count)
    ring = 5.0 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    sources = ring.astype(np.float32)
    field = DistanceField(distance, m, eye)
    light = FibreLight(sources, FORWARD, SPREAD, EACH)
    lit = dark = 0
    for ray in rng.standard_normal((120, 3)).astype(np.float32):
        ray /= np.sqrt((ray * ray).sum())
        along = tuple(ray.tolist())
        start = (f32(0), f32(0), f32(0))
        along = (f32(along[0]), f32(along[1]), f32(along[2]))
        t = sphere_trace(field, start, along, f32(40))
        assert t > 0
        at = (t * along[0], t * along[1], t * along[2])
        x, y, z = (eye[c] + at[c] for c in range(3))
        normal = sobel_normal(field, x, y, z)
        expected, shadows = one_by_one(field, at, normal, sources)
        found = direct(field, at, normal, light)
        # a source more or less would be a hundredth at least
        assert f32(found) == pytest.approx(expected, rel=1e-6)
        lit += int(expected > 0)
        dark += int(shadows > 0)
    assert lit > 20
    assert dark > 0
