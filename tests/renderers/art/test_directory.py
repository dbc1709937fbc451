import numpy as np
import pytest

from renderers.art.cells import CellGrid, CellShare
from renderers.art.directory import Directory, homes
from renderers.art.messages import Message, MessageKind, ProtocolError

GRID = CellGrid((17, 17, 25))
VALUES = np.random.default_rng(1).integers(0, 99, GRID.shape, np.int16)


def directory(rank: int, ranks: int) -> Directory:
    mine = np.flatnonzero(homes(GRID.cells, ranks) == rank)
    return Directory(rank, ranks, GRID, CellShare(GRID, VALUES, mine))


@pytest.mark.parametrize("ranks", [1, 2, 3, 7, 64])
def test_homes_burden_all_ranks_alike(ranks: int) -> None:
    counts = np.bincount(homes(32768, ranks), minlength=ranks)
    mean = 32768 / ranks
    assert np.abs(counts - mean).max() < 5 * np.sqrt(mean)


def test_homes_are_not_stripes() -> None:
    home = homes(4096, 4)
    same = [np.mean(home[step:] == home[:-step]) for step in (1, 16, 256)]
    assert max(same) < 0.6


def test_a_home_answers_with_the_cells_bytes() -> None:
    place = directory(1, 2)
    cell = int(np.flatnonzero(homes(GRID.cells, 2) == 1)[0])
    answer = place.answer(Message(MessageKind.REQUEST, 0, 1, 5, cell))
    assert (answer.kind, answer.target, answer.frame) == (MessageKind.DATA, 0, 5)
    block = place.share.decode(answer.payload)
    assert np.array_equal(block, GRID.block(VALUES, cell))
    assert place.served == 1


def test_only_a_home_answers() -> None:
    place = directory(1, 2)
    other = int(np.flatnonzero(homes(GRID.cells, 2) == 0)[0])
    with pytest.raises(ProtocolError, match="whose home is rank 0"):
        place.answer(Message(MessageKind.REQUEST, 0, 1, 5, other))
    with pytest.raises(ProtocolError, match="asked for cell 999"):
        place.answer(Message(MessageKind.REQUEST, 0, 1, 5, 999))
    with pytest.raises(ValueError, match="rank must be 0 to 1"):
        Directory(2, 2, GRID, place.share)
