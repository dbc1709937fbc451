"""Light by paths that can stop and go on, and says truly how far it is off."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, GBuffer
from renderers.shading.illumination import ScopeLight
from renderers.shading.path_sampling import PathSampling
from renderers.shading.path_tracer import PathLight, PathTracer, SeenWalls, estimate
from renderers.shading.tissue_colour import colour_table
from tests.renderers.shading.lit_ball import (
    BULB,
    CODE,
    RADIUS_MM,
    ball,
    looking,
    seen_inside,
)


@pytest.fixture(scope="module")
def tracer(surface: AirSurface) -> PathTracer:
    return PathTracer(surface, seed=3)


@pytest.fixture(scope="module")
def walls(sparse: GBuffer, camera: Camera) -> SeenWalls:
    return SeenWalls.of(sparse, camera, ScopeLight())


def sampled(
    tracer: PathTracer,
    walls: SeenWalls,
    steps: int,
    state: NDArray[np.float64] | None = None,
) -> PathSampling:
    sampling = PathSampling(tracer, walls, state)
    for _ in range(steps):
        sampling.step()
    return sampling


def walked(tracer: PathTracer, walls: SeenWalls, batches: int) -> NDArray[np.float64]:
    """Give the light of so many batches everywhere."""
    height, width = walls.shown.shape
    total = np.zeros((height, width, 3))
    squares = np.zeros_like(total)
    for batch in range(batches):
        tracer.walk(walls, batch, (0, height, 0, width), total, squares)
    return total / batches


def equal(a: PathLight, b: PathLight) -> None:
    assert_array_equal(a.irradiance, b.irradiance)
    assert_array_equal(a.standard_error, b.standard_error)
    assert_array_equal(a.batches, b.batches)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0, 2.3])
def test_going_on_is_never_having_stopped(
    tracer: PathTracer, walls: SeenWalls, share: float
) -> None:
    """Wherever it stops, also before every block has an error."""
    blocks = PathSampling(tracer, walls).blocks
    steps = 3 * blocks
    stop = int(share * blocks)
    whole = sampled(tracer, walls, steps)
    first = sampled(tracer, walls, stop)
    rest = sampled(tracer, walls, steps - stop, first.state())
    equal(rest.light(), whole.light())
    assert rest.noise() == whole.noise()
    assert rest.batches == whole.batches == steps


def test_threads_do_not_change_a_bit(surface: AirSurface, walls: SeenWalls) -> None:
    found = []
    for threads in (1, 3):
        tracer = PathTracer(surface, threads=threads)
        found.append(sampled(tracer, walls, 80).light())
        tracer.close()
    equal(*found)


def test_even_sampling_is_what_the_tracer_does_by_itself(
    tracer: PathTracer, walls: SeenWalls, tissue_gbuffer: GBuffer, camera: Camera
) -> None:
    """Two batches everywhere are those that `PathTracer.light` walks."""
    sampling = PathSampling(tracer, walls)
    assert math.isinf(sampling.noise())
    while not sampling.is_complete:
        assert math.isinf(sampling.noise())
        sampling.step()
    assert sampling.batches == 2 * sampling.blocks
    buffer = GBuffer(
        np.where(walls.shown, tissue_gbuffer.depth_mm, np.inf).astype(np.float32),
        walls.normals,
        walls.shown.astype(np.float32),
        tissue_gbuffer.material,
    )
    even = tracer.light(buffer, camera, ScopeLight(), batches=2)
    assert_array_equal(sampling.light().irradiance, even.irradiance)
    assert sampling.noise() == pytest.approx(even.noise(), rel=1e-5)


@pytest.mark.parametrize("confidence", [0.5, 0.9])
def test_the_error_told_covers_the_truth_as_often_as_it_says(confidence: float) -> None:
    """In an integrating sphere the truth is known: ``rho / (1 - rho) / R**2``."""
    tracer = PathTracer(ball(), bounces=40, seed=1)
    camera = looking((1.0, -2.0, 2.5), 32)
    walls = SeenWalls.of(seen_inside(camera), camera, BULB)
    sampling = sampled(tracer, walls, 4 * 8)
    light = sampling.light()
    tracer.close()
    rho = colour_table()[CODE, :3].astype(np.float64)
    truth = rho / (1 - rho) / RADIUS_MM**2
    seen = walls.shown
    # the interpolated ball is 0.1 % smaller: what is known of the truth
    off = np.abs(light.irradiance[seen] - light.irradiance[seen].mean(axis=0))
    assert light.irradiance[seen].mean(axis=0) == pytest.approx(truth, rel=0.01)
    covered = (off <= light.half_width(confidence)[seen]).mean()
    assert covered == pytest.approx(confidence, abs=0.04)


def test_noise_told_is_the_noise_there_is(tracer: PathTracer, walls: SeenWalls) -> None:
    blocks = PathSampling(tracer, walls).blocks
    other = PathTracer(tracer.surface, seed=77)
    one = sampled(tracer, walls, 10 * blocks)
    two = sampled(other, walls, 10 * blocks)
    other.close()
    a, b = one.light(), two.light()
    apart = math.sqrt(float(((a.irradiance - b.irradiance).astype(float) ** 2).mean()))
    mean = float(a.irradiance.mean())
    assert apart / mean == pytest.approx(math.hypot(one.noise(), two.noise()), rel=0.15)
    assert one.noise() == pytest.approx(a.noise(), rel=1e-4)


def test_a_damaged_state_is_refused(tracer: PathTracer, walls: SeenWalls) -> None:
    state = sampled(tracer, walls, 20).state()
    with pytest.raises(ValueError, match=r"goes on from float64 .*got float32"):
        PathSampling(tracer, walls, state.astype(np.float32))
    with pytest.raises(ValueError, match=r"got float64 \(4, 4, 7\)"):
        PathSampling(tracer, walls, state[:4, :4])
    for value in (math.nan, -1.0):
        wrong = state.copy()
        wrong[0, 0, 0] = value
        with pytest.raises(ValueError, match="is damaged; begin anew"):
            PathSampling(tracer, walls, wrong)
    wrong = state.copy()
    wrong[0, 0, 6] += 1
    with pytest.raises(ValueError, match="is damaged; begin anew"):
        PathSampling(tracer, walls, wrong)


def test_an_interval_needs_batches_and_a_share(
    tracer: PathTracer, walls: SeenWalls
) -> None:
    light = sampled(tracer, walls, 2).light()
    with pytest.raises(ValueError, match="confidence between 0 and 1"):
        light.half_width(1.0)
    bare = PathLight(light.irradiance, light.standard_error, 16)
    with pytest.raises(ValueError, match="number of batches, got"):
        bare.half_width(0.5)


def test_an_empty_view_is_dark_and_done(tracer: PathTracer, camera: Camera) -> None:
    empty = GBuffer.empty(camera.height, camera.width)
    sampling = PathSampling(tracer, SeenWalls.of(empty, camera, ScopeLight()))
    sampling.step()
    assert sampling.is_complete
    assert sampling.noise() == 0.0
    assert not sampling.light().irradiance.any()


def weighted(walls: SeenWalls) -> SeenWalls:
    """Show the light of some columns far better than that of others."""
    height, width = walls.shown.shape
    column = np.exp(-np.arange(width) / (0.2 * width)).astype(np.float32)
    weight = np.broadcast_to(column[:, None], (height, width, 3)).copy()
    return dataclasses.replace(walls, weight=weight)


def test_no_order_of_the_same_paths_changes_a_bit(
    tracer: PathTracer, walls: SeenWalls
) -> None:
    """Whatever comes first, a block with so many batches has the same light."""
    urgent = sampled(tracer, weighted(walls), 150).light()
    assert urgent.batches is not None
    blocks = [
        (y, min(y + 16, walls.shown.shape[0]), x, min(x + 16, walls.shown.shape[1]))
        for y in range(0, walls.shown.shape[0], 16)
        for x in range(0, walls.shown.shape[1], 16)
    ]
    turns = [
        number
        for number, block in enumerate(blocks)
        for _ in range(int(urgent.batches[block[0], block[2]]))
    ]
    for seed in range(2):
        order = np.random.default_rng(seed).permutation(turns) if seed else turns
        total = np.zeros((*walls.shown.shape, 3))
        squares = np.zeros_like(total)
        done = [0] * len(blocks)
        for number in order:
            tracer.walk(walls, done[number], blocks[number], total, squares)
            done[number] += 1
        found = estimate(walls, total, squares, urgent.batches)
        equal(found, urgent)


@pytest.mark.parametrize(
    ("is_weighted", "share", "bound"),
    # a straight tube is lit evenly: .969 of the error, the truth's own noise included
    [(False, 8, 0.98), (True, 3, 0.9), (True, 6, 0.9), (True, 12, 0.9)],
)
def test_stopped_early_it_is_nearer_to_the_picture_than_in_raster_order(
    tracer: PathTracer, walls: SeenWalls, is_weighted: bool, share: int, bound: float
) -> None:
    """At the same number of rays, the largest error first; the picture weighs it."""
    seen = weighted(walls) if is_weighted else walls
    other = PathTracer(tracer.surface, seed=99)
    truth = walked(other, walls, 64)
    other.close()

    def error(light: NDArray[Any]) -> float:
        weight = 1.0 if seen.weight is None else seen.weight
        return float(np.sqrt(((weight * (light - truth)) ** 2).mean()))

    blocks = PathSampling(tracer, seen).blocks
    urgent = sampled(tracer, seen, share * blocks).light()
    assert error(urgent.irradiance) < bound * error(walked(tracer, walls, share))
    assert urgent.batches is not None
    assert np.ptp(urgent.batches[walls.shown]) > 4 or share < 8
