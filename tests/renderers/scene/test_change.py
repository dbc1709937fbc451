"""Changes that are told together become fewer, and cover the same voxels."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene import Change, ChangeKind
from renderers.scene.change import merged

CORNERS = st.tuples(*[st.tuples(st.integers(0, 9), st.integers(0, 3))] * 3)
CHANGES = st.lists(st.tuples(CORNERS, st.sampled_from(ChangeKind)), max_size=12)


def covered(changes: list[Change], kind: ChangeKind) -> NDArray[np.bool_]:
    voxels = np.zeros((16, 16, 16), bool)
    for change in changes:
        if change.kind is kind:
            i, j, k = (
                slice(a, b + 1) for a, b in zip(change.low, change.high, strict=True)
            )
            voxels[i, j, k] = True
    return voxels


@given(CHANGES)
def test_the_same_voxels_are_told_of_in_rising_generations(
    drawn: list[tuple[tuple[tuple[int, int], ...], ChangeKind]],
) -> None:
    changes = [
        Change(
            number + 1,
            np.array([low for low, _ in corners]),
            np.array([low + more for low, more in corners]),
            kind,
        )
        for number, (corners, kind) in enumerate(drawn)
    ]
    fewer = merged(changes)
    assert len(fewer) <= len(changes)
    generations = [change.generation for change in fewer]
    assert generations == sorted(generations)
    assert generations[-1:] == [change.generation for change in changes[-1:]]
    told = voxels = 0
    for kind in ChangeKind:
        before, after = covered(changes, kind), covered(fewer, kind)
        assert np.all(after[before])
    for each in changes:
        voxels += int(np.prod(each.high - each.low + 1))
    for each in fewer:
        told += int(np.prod(each.high - each.low + 1))
    # never dearer than one by one
    assert told <= voxels


def test_dents_with_film_between_them_become_one() -> None:
    low, high = np.zeros(3, np.int64), np.full(3, 5)
    changes = [
        Change(n, low, high, ChangeKind.FILM if n % 2 else ChangeKind.DENT)
        for n in range(1, 9)
    ]
    assert [change.generation for change in merged(changes)] == [7, 8]
