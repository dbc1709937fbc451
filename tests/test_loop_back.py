import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.art.ranks.messages import Message, MessageKind
from renderers.art.ranks.transport import TransportError
from tests.loop_back import LoopBack


@given(
    sent=st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2)), max_size=40),
    seed=st.integers(0, 99),
)
def test_each_pair_keeps_its_order_and_nothing_is_lost(
    sent: list[tuple[int, int]], seed: int
) -> None:
    joint = LoopBack(3, seed)
    ends = [joint.end(rank) for rank in range(3)]
    for number, (source, target) in enumerate(sent):
        kind = MessageKind.DATA if number % 2 else MessageKind.REQUEST
        ends[source].send(Message(kind, source, target, 1, number))
    got: dict[tuple[int, int], list[int]] = {}
    while joint.in_flight:
        for end in ends:
            message = end.poll()
            if message is not None:
                pair = message.source, message.target
                got.setdefault(pair, []).append(message.cell)
                assert message.target == end.rank
    for pair, numbers in got.items():
        assert numbers == [n for n, p in enumerate(sent) if p == pair]
    assert sum(map(len, got.values())) == len(sent)


def test_the_same_seed_delivers_alike() -> None:
    def deliver() -> list[int]:
        joint = LoopBack(3, seed=4)
        for number in range(20):
            joint.put(Message(MessageKind.REQUEST, number % 3, 0, 1, number))
        order = []
        while joint.in_flight:
            message = joint.take(0)
            if message is not None:
                order.append(message.cell)
        return order

    first = deliver()
    assert first == deliver()
    assert first != sorted(first)


def test_there_is_nobody_beyond_the_last_rank() -> None:
    joint = LoopBack(2)
    with pytest.raises(TransportError, match="there is no rank 2"):
        joint.end(0).send(Message(MessageKind.REQUEST, 0, 2, 1))
    with pytest.raises(ValueError, match="no loop-back"):
        LoopBack(0)
