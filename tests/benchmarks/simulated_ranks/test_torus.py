import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.simulated_ranks.torus import Torus, torus_shape

LINK, HOP_S = 100.0, 0.5


def make_torus(ranks: int) -> Torus:
    return Torus(ranks, LINK, HOP_S)


@pytest.mark.parametrize(
    ("ranks", "shape"),
    [
        (1, (1, 1, 1)),
        (2, (2, 1, 1)),
        (8, (2, 2, 2)),
        (16, (4, 2, 2)),
        (13, (13, 1, 1)),
        (1024, (16, 8, 8)),
        (4096, (16, 16, 16)),
    ],
)
def test_a_torus_is_as_cubic_as_its_ranks_allow(
    ranks: int, shape: tuple[int, int, int]
) -> None:
    assert torus_shape(ranks) == shape


def test_a_torus_has_ranks() -> None:
    with pytest.raises(ValueError, match="at least 1 rank, got 0"):
        torus_shape(0)


@given(ranks=st.integers(1, 60), data=st.data())
def test_hops_are_a_metric_and_the_length_of_the_way(
    ranks: int, data: st.DataObject
) -> None:
    torus = make_torus(ranks)
    a, b, c = (data.draw(st.integers(0, ranks - 1)) for _ in range(3))
    assert torus.hops(a, a) == 0
    assert torus.hops(a, b) == torus.hops(b, a) == len(torus._find_route(a, b))
    assert torus.hops(a, c) <= torus.hops(a, b) + torus.hops(b, c)
    assert torus.hops(a, b) <= sum(n // 2 for n in torus.shape)
    assert math.prod(torus.shape) == ranks


def test_a_message_takes_its_bytes_and_its_hops() -> None:
    torus = make_torus(27)
    assert torus.carry(0, 13, 200, 1.0) == 1.0 + 3 * HOP_S + 2.0
    assert torus.carried == 600


def test_messages_wait_for_a_link_that_is_busy() -> None:
    torus = make_torus(5)
    assert torus.carry(0, 1, 200, 0.0) == 2.0 + HOP_S
    # The other direction is free; the same is not, nor is a way that goes on over it.
    assert torus.carry(1, 0, 100, 0.0) == 1.0 + HOP_S
    assert torus.carry(0, 2, 100, 1.0) == 2.0 + 1.0 + 2 * HOP_S
    assert torus.carry(3, 4, 100, 1.0) == 1.0 + 1.0 + HOP_S


@given(
    sent=st.lists(
        st.tuples(st.integers(0, 7), st.integers(0, 7), st.integers(1, 500)),
        max_size=60,
    )
)
def test_no_message_overtakes_another_of_its_pair(
    sent: list[tuple[int, int, int]],
) -> None:
    torus = make_torus(8)
    last: dict[tuple[int, int], float] = {}
    for number, (source, target, size) in enumerate(sent):
        if source != target:
            arrival = torus.carry(source, target, size, number / 10)
            assert arrival > last.get((source, target), 0.0)
            last[source, target] = arrival
