"""Hairs that are all out of view are not looked for, and only those."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from renderers.scene import AirSurface, Camera, GBuffer, Projection
from renderers.shading import ScopeLight
from renderers.shading.bands import RowBands
from renderers.shading.hairs import HairLayer, draw_hairs

LIGHT = ScopeLight(1.9)
SIZE = 40


class LooksAlways(HairLayer):
    """The layer without its ball."""

    def _is_beyond(self, camera: Camera, widest: float) -> bool:
        return False


@pytest.fixture(scope="module")
def layers(surface: AirSurface) -> tuple[HairLayer, HairLayer]:
    return HairLayer(surface, 7), LooksAlways(surface, 7)


def hairs_alone(layer: HairLayer, camera: Camera) -> np.ndarray:
    radiance = np.zeros((SIZE, SIZE, 3), np.float32)
    sources = LIGHT.sources(camera, 2)
    strands = layer.place(camera, LIGHT, sources)
    if strands is not None:
        draw_hairs(strands, radiance, GBuffer.empty(SIZE, SIZE), camera, RowBands(1))
    return radiance


@given(seed=st.integers(0, 2**32 - 1), equidistant=st.booleans())
@settings(max_examples=60)
def test_the_ball_around_them_hides_none(
    layers: tuple[HairLayer, HairLayer], seed: int, equidistant: bool
) -> None:
    random = np.random.default_rng(seed)
    roots = layers[0].strands.points_mm[:, 0]
    eye = random.choice(roots) + random.normal(0, 12, 3)
    toward = random.choice(roots) + random.normal(0, 20, 3)
    camera = Camera.looking_at(
        eye,
        toward,
        extent=0.6,
        size=(SIZE, SIZE),
        projection=Projection.EQUIDISTANT if equidistant else Projection.PERSPECTIVE,
    )
    with_ball, without = (hairs_alone(layer, camera) for layer in layers)
    assert_array_equal(with_ball, without)


def test_hairs_show_ahead_and_not_behind(layers: tuple[HairLayer, HairLayer]) -> None:
    middle = layers[0].strands.points_mm.mean(axis=(0, 1))
    eye = middle - [0, 40, 0]
    ahead, behind = (
        Camera.looking_at(eye, middle + way, extent=0.6, size=(SIZE, SIZE))
        for way in (np.zeros(3), np.array([0.0, -80, 0]))
    )
    assert hairs_alone(layers[0], ahead).any()
    assert not hairs_alone(layers[0], behind).any()
    assert not hairs_alone(layers[1], behind).any()
