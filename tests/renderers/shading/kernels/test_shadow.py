"""What capsules take of the light, against light that is cut into many points."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.shading.capsules import COLUMNS
from renderers.shading.kernels import pixel_block as b
from renderers.shading.kernels.shadow import BUNDLE_RADIUS_MM, darken, shadow

N = b.N
Doubles = NDArray[np.float64]


def capsule(
    start: list[float],
    end: list[float],
    radius: float,
    free: tuple[float, float] = (1, 1),
    absorbed: float = 1.0,
) -> NDArray[np.float32]:
    a, c = np.array(start, float), np.array(end, float)
    length = float(np.linalg.norm(c - a))
    row = [*a, *((c - a) / length), length, radius, *free, absorbed, 0]
    return np.array([row], np.float32).reshape(1, COLUMNS)


def block(points: Doubles, normals: Doubles, source: Doubles) -> NDArray[np.float32]:
    """Aim a block of N points ``(N, 3)`` at a source of intensity 1."""
    w = np.zeros(b.SLOTS, np.float32)
    to_source = source - points
    to_source = to_source / np.linalg.norm(to_source, axis=1, keepdims=True)
    for slot, values in ((b.PX, points), (b.NX, normals), (b.LX, to_source)):
        w[slot : slot + 3 * N] = values.T.ravel()
    w[b.POWER : b.POWER + N] = 1
    w[b.BOUNCE : b.BOUNCE + N] = 1
    return w


def left(w: NDArray[np.float32], slot: int) -> Doubles:
    return w[slot : slot + N].astype(np.float64)


def three(v: list[float]) -> tuple[np.float32, np.float32, np.float32]:
    return np.float32(v[0]), np.float32(v[1]), np.float32(v[2])


def shaded(
    points: Doubles,
    source: list[float],
    arc: list[float],
    capsules: NDArray[np.float32],
) -> Doubles:
    """Share of a source's light that points keep."""
    w = block(points, np.tile([0.0, 0, -1], (N, 1)), np.array(source))
    shadow(w, three(source), three(arc), capsules)
    return left(w, b.POWER)


def is_cut(point: Doubles, lights: Doubles, start: Doubles, end: Doubles, r: float) -> (
    NDArray[np.bool_]
):  # fmt: skip
    """Tell which straight ways from a point to lights meet a flat-ended capsule."""
    axis = (end - start) / np.linalg.norm(end - start)
    way = lights - point
    w = point - start
    across, from_ = way - np.outer(way @ axis, axis), w - (w @ axis) * axis
    a, h, c = (across**2).sum(1), across @ from_, from_ @ from_ - r * r
    root = np.sqrt(np.maximum(h * h - a * c, 0))
    first, last = (-h - root) / a, (-h + root) / a
    low, high = np.maximum(first, 0), np.minimum(last, 1)
    one, two = (w @ axis + np.array([low, high]) * (way @ axis)).reshape(2, -1)
    length = np.linalg.norm(end - start)
    overlaps = (np.maximum(one, two) >= 0) & (np.minimum(one, two) <= length)
    result: NDArray[np.bool_] = (h * h > a * c) & (low < high) & overlaps
    return result


def line_of_light(source: list[float], arc: list[float], seed: int) -> Doubles:
    """Points of bundles' ends along the line from source - arc to source + arc."""
    rng = np.random.default_rng(seed)
    n = 3000
    turn = rng.uniform(0, 2 * np.pi, n)
    disc = np.stack([np.cos(turn), np.sin(turn), np.zeros(n)], axis=1)
    disc *= BUNDLE_RADIUS_MM * np.sqrt(rng.random((n, 1)))
    along = rng.uniform(-1, 1, (n, 1))
    result: Doubles = np.array(source) + along * np.array(arc) + disc
    return result


@pytest.mark.parametrize("arc", [[0.0, 1.14, 0], [0.3, 0.3, 0]])
@pytest.mark.parametrize("gap", [0.1, 2.0, 8.0])
def test_a_shadow_is_that_of_many_small_lights(arc: list[float], gap: float) -> None:
    """A capsule over a wall: sharp where it is near, faint where it is far."""
    source, wall, r = [1.45, 0.0, 0.0], 15.0, 1.2
    start, end = (
        np.array([-0.5, 20.0, wall - gap - r]),
        np.array([0.0, -1.0, wall - gap - r]),
    )
    # the capsule lies across the line of points
    x = np.linspace(-6, 5, N)
    points = np.stack([x, np.full(N, 4.0), np.full(N, wall)], axis=1)
    lights = line_of_light(source, arc, 3)
    truth = np.array([1 - is_cut(p, lights, start, end, r).mean() for p in points])
    found = shaded(points, source, arc, capsule(start.tolist(), end.tolist(), r))
    assert truth.min() < 0.2
    assert truth.max() == 1
    error = found - truth
    assert np.sqrt((error**2).mean()) < 0.05
    assert abs(error.mean()) < 0.02


def test_the_tip_ends_the_shadow() -> None:
    source, arc, r = [1.45, 0.0, 0.0], [0.0, 0.4, 0.0], 1.2
    start, end = np.array([0.0, 20, 10]), np.array([0.0, 0, 10])
    y = np.linspace(-4, 6, N)
    points = np.stack([np.full(N, -0.72), y, np.full(N, 15.0)], axis=1)
    lights = line_of_light(source, arc, 4)
    truth = np.array([1 - is_cut(p, lights, start, end, r).mean() for p in points])
    found = shaded(points, source, arc, capsule(start.tolist(), end.tolist(), r))
    assert np.sqrt(((found - truth) ** 2).mean()) < 0.06
    assert found[0] > 0.99
    assert found[-1] < 0.01


def test_two_capsules_in_line_are_one_without_a_seam() -> None:
    points = np.stack([np.linspace(-3, 3, N), np.zeros(N), np.full(N, 15.0)], axis=1)
    one = capsule([0, -20, 10], [0, 20, 10], 1.2)
    two = np.concatenate(
        [
            capsule([0, -20, 10], [0, 1, 10], 1.2, (1, 0)),
            capsule([0, 1, 10], [0, 20, 10], 1.2, (0, 1)),
        ]
    )
    source, arc = [1.45, 0.0, 0.0], [0.0, 1.1, 0.0]
    np.testing.assert_allclose(
        shaded(points, source, arc, two), shaded(points, source, arc, one), atol=1e-4
    )


def test_a_capsule_aside_leaves_every_bit() -> None:
    points = np.stack([np.linspace(-3, 3, N), np.zeros(N), np.full(N, 15.0)], 1)
    found = shaded(
        points, [1.45, 0, 0], [0, 1, 0], capsule([9, -20, 3], [9, 20, 3], 1.2)
    )
    assert_array_equal(found, np.ones(N))


def test_a_capsule_is_not_dark_on_the_side_of_the_light() -> None:
    turn = np.linspace(-1.2, 1.2, N)
    points = np.stack(
        [1.2 * np.sin(turn), np.zeros(N), 10 - 1.2 * np.cos(turn)], axis=1
    )
    found = shaded(
        points, [0.0, 0, 0], [0, 0.5, 0], capsule([0, -9, 10], [0, 9, 10], 1.2)
    )
    assert found.min() > 0.98


@settings(max_examples=60)
@given(
    st.tuples(*[st.floats(-12, 12)] * 3),
    st.tuples(*[st.floats(-12, 12)] * 3),
    st.floats(0.05, 3),
    st.integers(0, 2**31),
)
def test_light_is_never_negative_and_never_more(
    start: tuple[float, ...], end: tuple[float, ...], radius: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    if np.linalg.norm(np.subtract(end, start)) < 0.01:
        return
    points = rng.uniform(-15, 15, (N, 3))
    normals = rng.normal(size=(N, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    capsules = capsule(list(start), list(end), radius)
    w = block(points, normals, np.array([1.45, 0, 0]))
    shadow(w, three([1.45, 0, 0]), three([0, 1, 0]), capsules)
    darken(w, capsules)
    for slot in (b.POWER, b.BOUNCE):
        found = left(w, slot)
        assert np.isfinite(found).all()
        assert found.min() >= 0
        assert found.max() <= 1


def seen_share(
    distance: float, r: float, tilt: float, low: float, high: float
) -> float:
    """View factor of a strip of the capsule's width along its axis, by summation."""
    s = np.linspace(low, high, 20001)
    normal = np.array([np.cos(tilt), 0, np.sin(tilt)])
    to = np.stack([np.full_like(s, distance), np.zeros_like(s), s], axis=1)
    rho2 = (to**2).sum(axis=1)
    cosine = np.maximum(to @ normal, 0) / np.sqrt(rho2)
    strip = distance / np.sqrt(rho2)
    integral = np.trapezoid(cosine * strip / rho2, s)
    return float(2 * r / np.pi * integral)


@pytest.mark.parametrize("distance", [1.3, 3.0, 10.0])
def test_an_endless_capsule_darkens_by_its_view_factor(distance: float) -> None:
    capsules = capsule([distance, 0, -1e4], [distance, 0, 1e4], 1.2)
    tilt = np.linspace(-2, 2, N)
    normals = np.stack([np.cos(tilt), np.sin(tilt), np.zeros(N)], axis=1)
    w = block(np.zeros((N, 3)), normals, np.array([0.0, 0, 9]))
    darken(w, capsules)
    exact = np.clip(1.2 / distance * np.cos(tilt), 0, 1)
    np.testing.assert_allclose(1 - left(w, b.BOUNCE), exact, atol=2e-3)


@pytest.mark.parametrize(("low", "high"), [(0.0, 8.0), (1.0, 3.0), (-2.0, 30.0)])
def test_the_end_of_a_capsule_darkens_by_what_is_seen_of_it(
    low: float, high: float
) -> None:
    distance, r = 4.0, 1.2
    capsules = capsule([distance, 0, low], [distance, 0, high], r)
    tilt = np.linspace(-0.2, 0.6, N)
    normals = np.stack([np.cos(tilt), np.zeros(N), np.sin(tilt)], axis=1)
    w = block(np.zeros((N, 3)), normals, np.array([0.0, 0, 9]))
    darken(w, capsules)
    exact = [seen_share(distance, r, t, low, high) for t in tilt]
    np.testing.assert_allclose(1 - left(w, b.BOUNCE), exact, atol=0.012)


def test_what_steel_sends_back_is_left() -> None:
    normals = np.tile([1.0, 0, 0], (N, 1))
    found = []
    for absorbed in (1.0, 0.4):
        w = block(np.zeros((N, 3)), normals, np.array([0.0, 0, 9]))
        darken(w, capsule([3, 0, -50], [3, 0, 50], 1.2, absorbed=absorbed))
        found.append(1 - left(w, b.BOUNCE)[0])
    assert found[1] == pytest.approx(0.4 * found[0], rel=1e-5)
