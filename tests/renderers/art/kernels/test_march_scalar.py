"""The compiled march against the same steps in plain Python, sample by sample."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.art.kernels.march_scalar import BISECTIONS, leap_out, per_voxel
from renderers.art.march import FrameRays
from renderers.art.quality import Quality
from renderers.art.ranks.prepare import make_node
from renderers.art.ranks.rays import RayPacket
from renderers.art.regions import Region
from renderers.reference import sobel_gradient
from renderers.scene import Camera, Scene, Volume

WHOLE = Region(0, 0, 8, 7)
F = np.float32
ZERO = np.float32(0)


def fields(volume: Volume) -> NDArray[np.float32]:
    """Stack the value and the gradient along the array's axes, (nz, ny, nx, 4)."""
    gradient = sobel_gradient(volume) @ volume.direction
    values = volume.values.astype(np.float64)[..., None]
    return np.concatenate([values, gradient], axis=-1).astype(np.float32)


def at(field: NDArray[np.float32], point: NDArray[np.float32]) -> NDArray[np.float32]:
    """Interpolate along x, then y, then z, in float32 as the kernel does."""
    top = np.array(field.shape[2::-1]) - 2
    i, j, k = np.clip(point.astype(int), 0, top)
    fx, fy, fz = point - np.array([i, j, k], np.float32)
    cube = field[k : k + 2, j : j + 2, i : i + 2]
    lines = cube[:, :, 0] + fx * (cube[:, :, 1] - cube[:, :, 0])
    faces = lines[:, 0] + fy * (lines[:, 1] - lines[:, 0])
    result: NDArray[np.float32] = faces[0] + fz * (faces[1] - faces[0])
    return result


def trace(scene: Scene, mode: str, camera: Camera) -> tuple[RayPacket, RayPacket]:
    """Give rays before and after the compiled march."""
    march, node, _ = make_node(scene, mode, Quality(0.5, 1 / 255, skip_empty=False))
    rays = FrameRays.of(camera)
    before, packet = march.start(WHOLE, rays), march.start(WHOLE, rays)
    node.begin(1, [packet])
    while not node.is_finished:
        node.advance(1)
    return before, packet


def test_classic_against_plain_python(scene: Scene, outside: Camera) -> None:
    before, packet = trace(scene, "classic", outside.with_size(8, 7))
    field = fields(scene.volume)
    spacing = scene.volume.spacing_mm
    material = scene.material
    axes = scene.volume.direction
    for ray in range(WHOLE.pixels):
        geometry = before.geometry[ray]
        color, clear = np.zeros(3), 1.0
        for i in range(before.count[ray]):
            point = geometry[:3] + F(i) * geometry[3:6]
            v, *g = at(field, point).astype(float)
            radiance, kappa = scene.transfer_function.evaluate(np.array([v]))
            if kappa[0] == 0:
                continue
            view = geometry[3:6] * spacing / geometry[6]
            normal = -np.array(g) / np.linalg.norm(g)
            diffuse, glint = np.full(3, material.ambient), np.zeros(3)
            for light in scene.lights:
                to = axes.T @ light.vector
                if light.is_local:
                    to = axes.T @ (light.vector - scene.volume.origin_mm)
                    to = to - point * spacing
                    to /= np.linalg.norm(to)
                half = (to - view) / np.linalg.norm(to - view)
                diffuse += material.diffuse * max(normal @ to, 0) * light.color
                power = max(normal @ half, 0) ** material.shininess
                glint += material.specular * power * light.color
            weight = clear * -math.expm1(-kappa[0] * geometry[6])
            color += weight * (radiance[0] * diffuse + glint)
            clear -= weight
            if clear < 1 / 255:
                break
        assert packet.result[ray] == pytest.approx([*color, 1 - clear], abs=2e-5)


def test_scope_against_plain_python(scene: Scene, inside: Camera) -> None:
    before, packet = trace(scene, "scope", inside.with_size(8, 7))
    assert scene.surface is not None
    field = fields(scene.surface.distance)
    hits = 0
    for ray in range(WHOLE.pixels):
        geometry = before.geometry[ray]

        def value(i: float, g: NDArray[np.float32] = geometry) -> NDArray[np.float32]:
            return at(field, g[:3] + F(i) * g[3:6])

        found = next((i for i in range(before.count[ray]) if value(i)[0] >= 0), None)
        if found is None:
            assert packet.depth[ray] == np.inf
            assert not packet.value[ray].any()
            continue
        hits += 1
        low, high = found - 1.0, float(found)
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            low, high = (low, middle) if value(middle)[0] >= 0 else (middle, high)
        v, *slope = value(high).astype(float)
        g = np.array(slope)
        rise = g @ (geometry[3:6] * scene.surface.distance.spacing_mm)
        back = min(v / rise, 1 / 2**BISECTIONS) if rise > 0 else 0.0
        depth = geometry[7] + F(high - back) * geometry[6]
        assert packet.depth[ray] == pytest.approx(depth, rel=1e-6)
        assert packet.value[ray] == pytest.approx(
            [*(-g / np.linalg.norm(g)), 1], abs=1e-5
        )
    assert hits > 20


@settings(max_examples=200)
@given(
    x=st.floats(0, 0.999),
    s=st.one_of(st.floats(-2, 2), st.sampled_from([0.0, -0.0, 1e-12, -1e-12, 1e-30])),
    cube=st.integers(0, 1000),
    distance=st.integers(1, 255),
    left=st.integers(1, 4000),
)
def test_a_leap_stays_in_empty_space_and_moves_on(
    x: float, s: float, cube: int, distance: int, left: int
) -> None:
    start, step = np.float32(cube + x), np.float32(s)
    middle = np.float32(cube + 0.5)
    jump = leap_out(
        start, middle, middle,
        per_voxel(step), per_voxel(ZERO), per_voxel(ZERO),
        cube, cube, cube, distance, left,
    )  # fmt: skip
    assert 1 <= jump <= left
    last = start + np.float32(jump - 1) * step
    low, high = cube - distance + 1, cube + distance
    assert low <= last < high or jump == 1
    if jump < left:
        # Short by at most the precaution, two samples and rounding.
        short = last + np.float32(2) * step + np.sign(step) * np.float32(2.2e-3)
        assert not low + 1e-3 < short < high - 1e-3 or abs(step) < 1e-5
