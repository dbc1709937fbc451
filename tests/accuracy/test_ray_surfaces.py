"""Surfaces met by rays of mode `classic`: opaque planes, balls under light.

S7: an opaque plane ends rays within a uniform medium, in the middle of a step. S9: an
opaque ball under a head light, Lambert's law. Lengths in millimetres.
"""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.scene import (
    Camera,
    Light,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)

FINAL = Quality.named("final")
KAPPA = -math.log1p(-0.05)
UNIFORM = TransferFunction(np.array([-1.0, 1.0]), np.ones((2, 3)), np.full(2, KAPPA))


def box() -> Scene:
    """Fill a cube of 32 mm with opacity .05 a millimetre, white."""
    volume = Volume(np.zeros((33, 33, 33), np.int16), np.ones(3), np.full(3, -16.0))
    return Scene(volume, UNIFORM, (), PhongMaterial(1, 0, 0))


def looking_along_y(
    projection: Projection, size: int = 9, extent: float = 10.0
) -> Camera:
    return Camera.looking_at(
        [0.03, -40.0, 0.02], [0.03, 0.0, 0.02], extent=extent, size=(size, size),
        projection=projection,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("depth", "alpha"), [(10.3, 0.410405892482930), (0.4, 0.020308269733770)]
)
def test_a_plane_ends_rays_where_it_is(depth: float, alpha: float) -> None:
    """S7: neither the steps' ends nor the voxels' know of it."""
    camera = looking_along_y(Projection.ORTHOGRAPHIC)
    limit = np.full((9, 9), 24 + depth, np.float32)
    for step in (0.25, 1.0, 4.0):
        tracer = ActiveRayTracer(box(), Quality(step, 0.0), threads=1)
        rgba = tracer.render(camera, limit_mm=limit).rgba
        assert rgba[..., 3] == pytest.approx(alpha, abs=2e-6)
        # Black and grey behind it: what is left of their light is added.
        light = rgba[..., 0] + 0.5 * (1 - rgba[..., 3])
        assert light == pytest.approx(alpha + 0.5 * (1 - alpha), abs=2e-6)


def test_a_slanted_plane_ends_each_ray_by_itself() -> None:
    camera = looking_along_y(Projection.PERSPECTIVE, 21, math.radians(15))
    origins, directions = camera.rays()
    normal = np.array([0.2, 1.0, -0.1])
    limit = (-3.0 - origins @ normal) / (directions @ normal)
    rgba = (
        ActiveRayTracer(box(), FINAL).render(camera, limit_mm=limit.astype("f4")).rgba
    )
    enters = (-16.0 - origins[..., 1]) / directions[..., 1]
    length = np.maximum(limit - enters, 0)
    assert 0 < length.min() < length.max()
    assert rgba[..., 3] == pytest.approx(-np.expm1(-KAPPA * length), abs=3e-6)


def test_what_ends_before_the_volume_shows_nothing() -> None:
    camera = looking_along_y(Projection.ORTHOGRAPHIC)
    tracer = ActiveRayTracer(box(), FINAL)
    whole = tracer.render(camera).rgba
    for most, expected in ((0.0, 0 * whole), (24.0, 0 * whole), (1e9, whole)):
        limit = np.full((9, 9), most, np.float32)
        assert np.array_equal(tracer.render(camera, limit_mm=limit).rgba, expected)


@pytest.mark.parametrize("bad", [np.full((9, 9), np.nan, "f4"), np.zeros((9, 8), "f4")])
def test_limits_that_do_not_fit_are_refused(bad: NDArray[np.float32]) -> None:
    camera = looking_along_y(Projection.ORTHOGRAPHIC)
    with pytest.raises(ValueError, match=r"limits of rays must be numbers of shape"):
        ActiveRayTracer(box(), FINAL).render(camera, limit_mm=bad)


def test_a_ball_under_a_head_light_follows_lambert() -> None:
    """S9: to two parts in a hundred, where the light falls on it at all steeply."""
    h, radius = 0.25, 8.0
    axis = (np.arange(81) - 40) * h
    r = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    values = np.clip(np.rint(200 * (radius - r)), -1000, 1000).astype(np.int16)
    volume = Volume(values, np.full(3, h), np.full(3, -10.0))
    opaque = TransferFunction(
        np.array([-0.01, 0.0]), np.ones((2, 3)), np.array([0.0, 200.0])
    )
    light = Light(np.array([0.0, -1.0, 0.0]), np.ones(3))
    scene = Scene(volume, opaque, (light,), PhongMaterial(0.0, 1.0, 0.0))
    camera = looking_along_y(Projection.ORTHOGRAPHIC, 64, 8.0)
    rgba = ActiveRayTracer(scene, FINAL).render(camera).rgba
    origins, _ = camera.rays()
    b = np.hypot(origins[..., 0], origins[..., 2])
    cosine = np.sqrt(np.maximum(1 - (b / radius) ** 2, 0))
    lit = cosine > 0.2
    assert rgba[lit, 0] == pytest.approx(cosine[lit], abs=0.02)
    assert rgba[lit, 3] == pytest.approx(1, abs=1e-4)
