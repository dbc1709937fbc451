import numpy as np
import pytest

from renderers.art.ranks.directory import (
    MOST_ASKED,
    ON_DISK,
    Directory,
    deal_owners,
    homes,
    ring_distances,
)
from renderers.art.ranks.messages import Message, MessageKind, ProtocolError

RANKS = 5
HOME = np.array([0, 1, 0, 0])
OWNER = np.array([3, 3, 2, -1])


def directory() -> Directory:
    return Directory(0, HOME, OWNER, ring_distances(RANKS))


def said(place: Directory, kind: MessageKind, source: int, aux: int = 0) -> Message:
    return place.handle(Message(kind, source, 0, 5, 0, generation=2, aux=aux))


@pytest.mark.parametrize("ranks", [1, 2, 3, 7, 64])
def test_homes_burden_all_ranks_alike(ranks: int) -> None:
    counts = np.bincount(homes(32768, ranks), minlength=ranks)
    mean = 32768 / ranks
    assert np.abs(counts - mean).max() < 5 * np.sqrt(mean)


def test_homes_are_not_stripes() -> None:
    home = homes(4096, 4)
    same = [np.mean(home[step:] == home[:-step]) for step in (1, 16, 256)]
    assert max(same) < 0.6


@pytest.mark.parametrize("ranks", [1, 2, 5])
def test_owners_share_what_is_to_be_seen_in_runs(ranks: int) -> None:
    seen = np.random.default_rng(0).random(97) < 0.6
    owner = deal_owners(seen, ranks)
    assert np.array_equal(owner >= 0, seen)
    counts = np.bincount(owner[seen], minlength=ranks)
    assert counts.max() - counts.min() <= 1
    assert (np.diff(owner[seen]) >= 0).all()


def test_a_cell_that_nobody_has_is_read_by_its_home_which_forgets_nobody() -> None:
    place = Directory(0, HOME, np.full(4, ON_DISK), ring_distances(RANKS))
    first = said(place, MessageKind.REQUEST, 1)
    assert (first.kind, first.target, first.payload) == (MessageKind.DATA, 1, b"")
    second = said(place, MessageKind.REQUEST, 3)
    assert (second.kind, second.target, second.who) == (MessageKind.FORWARD, 1, 3)
    assert place.listed(0) == {1, 3}
    for rank in (1, 3):
        gone = said(place, MessageKind.INVALIDATE_REQUEST, rank)
        assert (gone.kind, gone.target) == (MessageKind.INVALIDATE, rank)
    assert place.listed(0) == set()
    assert said(place, MessageKind.REQUEST, 0).kind is MessageKind.DATA
    with pytest.raises(ProtocolError, match="rank 4 would drop cell 0 unlisted"):
        said(place, MessageKind.INVALIDATE_REQUEST, 4)


def test_a_request_goes_to_the_nearest_holder_and_lists_who_asked() -> None:
    place = directory()
    first = said(place, MessageKind.REQUEST, 1)
    assert (first.kind, first.target, first.who) == (MessageKind.FORWARD, 3, 1)
    assert (first.frame, first.generation, first.cell) == (5, 2, 0)
    # Rank 1 is listed before the cell has reached it, and nearer to 0 than 3 is.
    assert said(place, MessageKind.REQUEST, 0).target == 1
    assert said(place, MessageKind.REQUEST, 2).target in (1, 3)
    assert place.entries[0].replicas == [1, 0, 2]
    place.check()
    with pytest.raises(ProtocolError, match="rank 2 asked for cell 0 it has"):
        said(place, MessageKind.REQUEST, 2)


def test_equally_near_holders_share_the_load() -> None:
    ranks = 8
    place = Directory(0, HOME, OWNER, lambda rank: [1] * ranks)
    place.entry(0).replicas.extend([0, 1, 2, 4, 5, 6, 7])
    chosen = {place._closest(rank, [0, 2, 4, 6]) for rank in (1, 3, 5, 7)}
    assert chosen == {0, 2, 4, 6}


def test_a_replica_may_always_go_and_the_last_copy_never() -> None:
    place = directory()
    said(place, MessageKind.REQUEST, 1)
    answer = said(place, MessageKind.INVALIDATE_REQUEST, 1)
    assert (answer.kind, answer.target) == (MessageKind.INVALIDATE, 1)
    answer = said(place, MessageKind.INVALIDATE_REQUEST, 3)
    assert (answer.kind, answer.target) == (MessageKind.KEEP, 3)
    with pytest.raises(ProtocolError, match="rank 1 would drop cell 0 unlisted"):
        said(place, MessageKind.INVALIDATE_REQUEST, 1)


def test_an_owner_goes_when_another_takes_over() -> None:
    place = directory()
    for rank in (1, 2, 4):
        said(place, MessageKind.REQUEST, rank)
    asked = said(place, MessageKind.INVALIDATE_REQUEST, 3)
    assert (asked.kind, asked.target) == (MessageKind.ADOPT, 4)
    with pytest.raises(ProtocolError, match="would drop cell 0 twice"):
        said(place, MessageKind.INVALIDATE_REQUEST, 3)
    with pytest.raises(ProtocolError, match="rank 1 was not asked to adopt 0"):
        said(place, MessageKind.ADOPTED, 1, aux=1)
    asked = said(place, MessageKind.ADOPTED, 4, aux=0)
    assert (asked.kind, asked.target) == (MessageKind.ADOPT, 2)
    freed = said(place, MessageKind.ADOPTED, 2, aux=1)
    assert (freed.kind, freed.target) == (MessageKind.INVALIDATE, 3)
    assert place.entries[0].owner == 2
    assert place.entries[0].replicas == [1, 4]
    assert place.moves == 1
    place.check()


def test_an_owner_stays_when_enough_have_declined() -> None:
    place = directory()
    for rank in (0, 1, 2, 4):
        said(place, MessageKind.REQUEST, rank)
    answer = said(place, MessageKind.INVALIDATE_REQUEST, 3)
    for _ in range(MOST_ASKED):
        assert answer.kind is MessageKind.ADOPT
        answer = said(place, MessageKind.ADOPTED, answer.target, aux=0)
    assert (answer.kind, answer.target) == (MessageKind.KEEP, 3)


def test_only_a_home_answers() -> None:
    place = directory()
    with pytest.raises(ProtocolError, match="whose home is rank 1"):
        place.handle(Message(MessageKind.REQUEST, 2, 0, 5, 1))
    with pytest.raises(ProtocolError, match="asked for cell 999"):
        place.handle(Message(MessageKind.REQUEST, 2, 0, 5, 999))
    with pytest.raises(ProtocolError, match="cell 3 is empty"):
        place.handle(Message(MessageKind.REQUEST, 2, 0, 5, 3))
