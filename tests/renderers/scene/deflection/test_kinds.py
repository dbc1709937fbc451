from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene.deflection import (
    Cut,
    Deflector,
    FoldError,
    Rotation,
    Scaling,
    Translation,
)

CENTER = np.array([1.0, -2.0, 3.0])
RADIUS = 4.0
WAY = np.array([0.6, -0.3, 0.74])

KINDS: list[Deflector] = [
    Translation(CENTER, RADIUS, 0.61 * RADIUS * WAY),
    Translation(CENTER, RADIUS, 0.2 * RADIUS * WAY),
    Rotation(CENTER, RADIUS, WAY, 2.5),
    Scaling(CENTER, RADIUS, 0.46),
    Scaling(CENTER, RADIUS, 4.0),
    Cut(CENTER, RADIUS, WAY, 0.6 * RADIUS),
]

every_kind = pytest.mark.parametrize("deflector", KINDS, ids=lambda d: type(d).__name__)


def places(seed: int, count: int = 500) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    return CENTER + rng.uniform(-1.2 * RADIUS, 1.2 * RADIUS, (count, 3))


@every_kind
@given(seed=st.integers(0, 10_000))
def test_tissue_appears_where_its_pull_back_is_it(
    deflector: Deflector, seed: int
) -> None:
    q = places(seed)
    x = deflector.push_forward(q)
    assert np.abs(deflector.pull_back(x) - q).max() < 1e-9
    # the other way round, but for the gap of a cut, which no tissue is seen in
    seen = deflector.opening(q) > 1e-9
    back = deflector.push_forward(deflector.pull_back(q))[seen]
    assert np.abs(back - q[seen]).max() < 1e-6


@every_kind
def test_the_jacobian_is_that_of_the_pull_back(deflector: Deflector) -> None:
    x = places(3)
    step = 1e-6
    columns = [
        (deflector.pull_back(x + h) - deflector.pull_back(x - h)) / (2 * step)
        for h in step * np.eye(3)
    ]
    wanted = np.stack(columns, axis=-1)
    # neither across a cut nor across the rim, where second derivatives jump
    smooth = np.abs((x - CENTER) @ WAY) > 1e-3
    error = np.abs(deflector.jacobian(x) - wanted).max(axis=(1, 2))
    assert error[smooth].max() < 1e-7


@every_kind
def test_nothing_folds(deflector: Deflector) -> None:
    x = places(4, 4000)
    assert np.linalg.det(deflector.jacobian(x)).min() > 0.01


@every_kind
def test_outside_the_ball_and_on_its_rim_nothing_moves(deflector: Deflector) -> None:
    way = np.random.default_rng(5).normal(size=(100, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    for factor in (1.0, 1.5, 100.0):
        x = CENTER + factor * RADIUS * way
        assert np.abs(deflector.pull_back(x) - x).max() < 1e-12
        assert np.abs(deflector.push_forward(x) - x).max() < 1e-12
    inside = CENTER + 0.9999 * RADIUS * way
    assert np.all(deflector.inside(deflector.push_forward(inside)))


@pytest.mark.parametrize(
    "deflector",
    [
        Translation(CENTER, RADIUS, np.zeros(3)),
        Rotation(CENTER, RADIUS, WAY, 0.0),
        Scaling(CENTER, RADIUS, 1.0),
    ],
)
def test_nothing_done_is_the_identity(deflector: Deflector) -> None:
    x = places(6)
    assert np.array_equal(deflector.pull_back(x), x)
    assert np.allclose(deflector.push_forward(x), x, rtol=0, atol=1e-15)
    assert np.array_equal(
        deflector.jacobian(x), np.broadcast_to(np.eye(3), (500, 3, 3))
    )


def test_at_the_centre_it_does_what_it_says() -> None:
    shift = np.array([0.5, 0.4, -0.3])
    pulled = Translation(CENTER, RADIUS, shift)
    assert np.allclose(pulled.push_forward((CENTER - shift)[None]), CENTER)
    # a quarter turn about z takes x to y
    turned = Rotation(np.zeros(3), RADIUS, np.array([0, 0, 2.0]), np.pi / 2)
    assert np.allclose(turned.push_forward(np.array([[1e-5, 0, 0]])), [[0, 1e-5, 0]])
    swollen = Scaling(np.zeros(3), RADIUS, 3.0).push_forward(np.array([[1e-5, 0, 0]]))
    assert np.allclose(swollen, [[3e-5, 0, 0]], rtol=1e-6)


def test_a_rotation_keeps_distances_from_the_centre() -> None:
    x = places(8)
    moved = KINDS[2].pull_back(x)
    before, after = (np.linalg.norm(p - CENTER, axis=1) for p in (x, moved))
    assert np.allclose(before, after, rtol=1e-14)


def test_a_cut_opens_by_its_gap_and_each_side_stays_on_its_side() -> None:
    cut = Cut(CENTER, RADIUS, WAY, 1.0)
    q = places(9)
    side = cut.side(q)
    assert np.array_equal(cut.side(cut.push_forward(q)), side)
    assert np.all(cut.opening(cut.push_forward(q)) > -1e-9)
    normal = WAY / np.linalg.norm(WAY)
    # half the gap at the centre is h = pull w(h)
    half = 0.0
    for _ in range(100):
        half = (1 - (half / RADIUS) ** 2) ** 2
    across = CENTER + np.linspace(-0.999, 0.999, 21)[:, None] * half * normal
    assert np.all(cut.opening(across) < 0)
    assert cut.opening(CENTER[None])[0] == pytest.approx(-1.0)
    assert cut.opening((CENTER + half * normal)[None])[0] == pytest.approx(0, abs=1e-12)
    # the face of the side that the normal points to
    face = cut.push_forward(CENTER[None] + 1e-12 * normal)
    assert cut.opening(face)[0] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "arguments", "error", "words"),
    [
        (Translation, (CENTER, 4.0, np.array([2.5, 0, 0])), FoldError, "2.5 mm"),
        (Cut, (CENTER, 4.0, WAY, 2.5), FoldError, "2.5 mm"),
        (Scaling, (CENTER, 4.0, 0.4), FoldError, "0.4 .*0.457 to 20"),
        (Scaling, (CENTER, 4.0, 30.0), FoldError, "30"),
        (Translation, (np.zeros(2), 4.0, WAY), ValueError, "center"),
        (Translation, (CENTER, 0.0, WAY), ValueError, "radius .*0.0"),
        (Translation, (CENTER, 4.0, WAY * np.nan), ValueError, "shift"),
        (Rotation, (CENTER, 4.0, np.zeros(3), 1.0), ValueError, "direction"),
        (Rotation, (CENTER, 4.0, WAY, np.inf), ValueError, "finite"),
        (Scaling, (CENTER, 4.0, -1.0), ValueError, "factor .*-1.0"),
        (Cut, (CENTER, 4.0, WAY, 0.0), ValueError, "pull"),
        (Cut, (CENTER, 4.0, np.zeros(3), 1.0), ValueError, "normal"),
    ],
)
def test_what_folds_or_is_no_deflector_is_refused(
    kind: Any, arguments: tuple[Any, ...], error: type[ValueError], words: str
) -> None:
    with pytest.raises(error, match=words):
        kind(*arguments)


@every_kind
def test_nothing_is_stretched_more_than_is_said(deflector: Deflector) -> None:
    """And not much less: a turn shears by 1 at most where it also turns."""
    jacobian = deflector.jacobian(places(2, 20_000))
    largest = np.linalg.norm(jacobian, ord=2, axis=(1, 2)).max()
    assert largest <= deflector.stretch + 1e-9
    assert largest > (0.7 if isinstance(deflector, Rotation) else 0.93) * (
        deflector.stretch
    )
