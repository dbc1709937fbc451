import numpy as np
from numpy.typing import NDArray

from renderers.scene.deflection import Cut, Deflection, Rotation, Scaling, Translation

MIDDLE = np.array([1.0, 2.0, 3.0])
CHAIN = Deflection(
    (
        Translation(MIDDLE, 5.0, np.array([1.0, -1.5, 0.5])),
        Rotation(MIDDLE + np.array([2, 0, 0]), 4.0, np.array([0.0, 1.0, 1.0]), 1.2),
        Scaling(MIDDLE - np.array([1, 1, 0]), 6.0, 1.6),
    )
)


def places(count: int = 400) -> NDArray[np.float64]:
    return MIDDLE + np.random.default_rng(1).uniform(-8, 8, (count, 3))


def test_an_empty_chain_is_the_identity() -> None:
    x = places()
    none = Deflection()
    assert np.array_equal(none.pull_back(x), x)
    assert np.array_equal(none.push_forward(x), x)
    assert np.array_equal(none.jacobian(x), np.broadcast_to(np.eye(3), (400, 3, 3)))
    assert not none.moves(x).any()
    assert np.all(np.isinf(none.opening(x)))


def test_a_chain_is_its_links_in_turn() -> None:
    q = places()
    x = q
    for deflector in CHAIN.deflectors:
        x = deflector.push_forward(x)
    assert np.allclose(CHAIN.push_forward(q), x, rtol=0, atol=1e-12)
    assert np.abs(CHAIN.pull_back(x) - q).max() < 1e-9
    one, two = Deflection(CHAIN.deflectors[:1]), Deflection(CHAIN.deflectors[1:])
    both = two.push_forward(one.push_forward(q))
    assert np.array_equal(CHAIN.push_forward(q), both)


def test_the_jacobian_follows_the_chain_rule() -> None:
    x = places()
    step = 1e-6
    columns = [
        (CHAIN.pull_back(x + h) - CHAIN.pull_back(x - h)) / (2 * step)
        for h in step * np.eye(3)
    ]
    error = np.abs(CHAIN.jacobian(x) - np.stack(columns, axis=-1))
    assert error.max() < 1e-6


def test_only_what_is_in_a_ball_moves() -> None:
    x = places(4000)
    stays = ~CHAIN.moves(x)
    assert 0 < stays.sum() < len(x)
    assert np.array_equal(CHAIN.pull_back(x)[stays], x[stays])
    assert np.array_equal(CHAIN.push_forward(x)[stays], x[stays])


def test_a_cut_that_is_moved_later_is_found_where_it_is_seen() -> None:
    cut = Cut(MIDDLE, 3.0, np.array([1.0, 0, 0]), 0.5)
    shift = np.array([0.0, 1.0, 0.0])
    moved = Deflection((cut, Translation(MIDDLE, 8.0, shift)))
    assert moved.opening((MIDDLE + shift)[None])[0] < -0.45
    assert (
        Deflection((cut,)).opening((MIDDLE + np.array([0, 3.1, 0]))[None])[0] == np.inf
    )


def test_a_chain_stretches_no_more_than_its_links_together() -> None:
    largest = np.linalg.norm(CHAIN.jacobian(places(4000)), ord=2, axis=(1, 2)).max()
    assert 1.0 < largest <= CHAIN.stretch
