"""Splats lit for who blends them elsewhere are those of the rasterizer."""

from dataclasses import replace

import numpy as np
import pytest

from anatomy import classic_transfer_function
from renderers.fsr import FuzzySetRenderer
from renderers.fsr.splats.shaded_set import ShadedSet
from renderers.scene import Light, PhongMaterial, Scene, Volume


def ball(lights: tuple[Light, ...] | None = None) -> Scene:
    axis = np.arange(25) - 12.0
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    inside = 8 - np.sqrt(x**2 + y**2 + z**2)
    hu = np.clip(500 * inside, -1000, 600).astype(np.int16)
    volume = Volume(hu, np.ones(3), np.full(3, axis[0]))
    scene = Scene(volume, classic_transfer_function(), material=PhongMaterial(0.3, 0.6))
    return scene if lights is None else replace(scene, lights=lights)


@pytest.mark.parametrize("is_local", [False, True])
def test_splats_are_lit_as_a_formula_says(is_local: bool) -> None:
    near = Light(np.array([0.0, -40.0, 20.0]), np.array([0.8, 0.5, 0.3]), is_local)
    scene = ball((near,) if is_local else None)
    fuzzy = FuzzySetRenderer(scene, threads=1).fuzzy_set
    places = fuzzy.rows.centers_mm()
    colors = ShadedSet(fuzzy, scene).straight_rgba()
    base, _ = scene.transfer_function.evaluate(fuzzy.value.astype(np.float64))
    normal = places / np.linalg.norm(places, axis=1, keepdims=True)
    lit = np.full_like(base, 0.3)
    for light in scene.lights:
        towards = light.vector - places if is_local else light.vector[None]
        towards = towards / np.linalg.norm(towards, axis=1, keepdims=True)
        cosine = (normal * towards).sum(axis=1, keepdims=True)
        lit += 0.6 * np.maximum(cosine, 0) * light.color
    # a ball's own normals differ from estimated ones by a few degrees
    assert np.abs(colors[:, :3] - base * lit).max() < 0.05
    assert np.all((colors[:, 3] > 0) & (colors[:, 3] <= 1))
