"""Light on samples, against the formula of Blinn and Phong in double precision."""

from typing import Any

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.shade_samples import any_local, are_grey, light_up
from renderers.lanes import full, load, store

WIDTH = 16
LEAST = np.float32(0.05)


@njit
def light_all(lights: Any, material: Any, rows: Any, out: Any) -> None:
    n = rows.shape[1]
    grey = are_grey(lights)
    for i in range(0, n, WIDTH):
        one = full(np.float32(1), WIDTH)
        r, g, b = light_up(
            lights, grey, material, LEAST, one,
            (load(rows, i, WIDTH), load(rows, n + i, WIDTH),
             load(rows, 2 * n + i, WIDTH)),
            (load(rows, 3 * n + i, WIDTH), load(rows, 4 * n + i, WIDTH),
             load(rows, 5 * n + i, WIDTH)),
            (load(rows, 6 * n + i, WIDTH), load(rows, 7 * n + i, WIDTH),
             load(rows, 8 * n + i, WIDTH)),
            (load(rows, 9 * n + i, WIDTH), load(rows, 10 * n + i, WIDTH),
             load(rows, 11 * n + i, WIDTH)),
        )  # fmt: skip
        store(out, i, r)
        store(out, n + i, g)
        store(out, 2 * n + i, b)


def light_one(
    lights: NDArray[np.float32],
    material: NDArray[np.float32],
    sample: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Light one sample: colour, gradient, place and direction of the ray."""
    color, gradient, place, way = sample.reshape(4, 3)
    steep = np.linalg.norm(gradient)
    if steep <= LEAST:
        return color
    normal, given, glint = (
        -gradient / steep,
        np.full(3, float(material[0])),
        np.zeros(3),
    )
    for light in lights.astype(np.float64):
        to = light[:3]
        if light[9]:
            to = (to - place) / np.linalg.norm(to - place)
        half = (to - way) / np.linalg.norm(to - way)
        given += max(normal @ to, 0) * light[3:6]
        if material[1] > 0:
            glint += max(normal @ half, 0) ** float(material[2]) * light[6:9]
    return np.asarray(color * given + glint)


def some_lights(count: int, grey: bool, local: int) -> NDArray[np.float32]:
    """Make lights as `march_packets` takes them; every local-th is local."""
    random = np.random.default_rng(count)
    lights = np.zeros((count, 10), np.float32)
    lights[:, :3] = random.normal(size=(count, 3))
    lights[:, :3] /= np.linalg.norm(lights[:, :3], axis=1, keepdims=True)
    lights[:, 3:9] = random.random((count, 6))
    if grey:
        lights[:, 4:6] = lights[:, 3:4]
        lights[:, 7:9] = lights[:, 6:7]
    if local:
        lights[::local, 9] = 1
    return lights


@pytest.mark.parametrize("specular", [0.0, 0.4])
@pytest.mark.parametrize("grey", [False, True])
@pytest.mark.parametrize(("count", "local"), [(0, 0), (1, 0), (1, 1), (4, 0), (5, 2)])
def test_any_lights_light_a_sample_by_the_formula(
    count: int, local: int, grey: bool, specular: float
) -> None:
    lights = some_lights(count, grey, local)
    material = np.array([0.25, specular, 12.0], np.float32)
    random = np.random.default_rng(7)
    rows = random.normal(size=(12, 96)).astype(np.float32)
    rows[:3] = random.random((3, 96))
    rows[9:] /= np.linalg.norm(rows[9:], axis=0)
    # Some have hardly a gradient, some have none.
    rows[3:6, ::7] *= np.float32(1e-3)
    rows[3:6, ::11] = 0
    found = np.zeros((3, 96), np.float32)
    light_all(lights, material, rows, found)
    samples = rows.T.astype(np.float64)
    expected = np.array([light_one(lights, material, sample) for sample in samples])
    # highlights of 12 factors lose a digit
    np.testing.assert_allclose(found.T, expected, rtol=2e-6, atol=2e-6)
    assert are_grey(lights) == (grey or count == 0)
    assert any_local(lights) == (local > 0)


def test_one_channel_is_enough_only_if_it_is_for_all_lights() -> None:
    for place in range(3, 9):
        lights = some_lights(3, grey=True, local=0)
        assert are_grey(lights)
        lights[2, place] += 0.25
        assert not are_grey(lights)
