"""Compiled counts continue as plain integers do."""

from math import inf

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.kernels.continue_counts import continue_counts
from devices.microscribe.kinematics.arm import FIELD

_six = st.lists(st.integers(-200_000, 200_000), min_size=6, max_size=6)
_readings = st.lists(st.integers(0, FIELD - 1), min_size=6, max_size=6)


@given(_readings, _six, st.integers(0, 5000), st.sampled_from([2000, 4096, FIELD]))
def test_counts_continue_as_plain_integers_do(
    reading: list[int], last: list[int], ticks: int, window: int
) -> None:
    windows, fastest = [window] * 6, [0.01 * i for i in range(5)] + [inf]
    counts = np.empty(6, dtype=np.int64)
    plausible = continue_counts(
        np.array(reading),
        np.array(last),
        FIELD,
        np.array(windows),
        np.array(fastest),
        ticks,
        2,
        counts,
    )
    expected = True
    for i in range(6):
        step = (reading[i] - last[i] + FIELD // 2) % FIELD - FIELD // 2
        assert counts[i] == last[i] + step
        # within the window, too, the shorter way round counts
        shortest = (step + window // 2) % window - window // 2
        most = 2 if ticks == 0 else fastest[i] * ticks + 2
        expected &= (ticks == 0 and fastest[i] == inf) or abs(shortest) <= most
    assert plausible == expected


@given(_readings, st.integers(-(1 << 40), 1 << 40))
def test_a_wrap_is_one_count(reading: list[int], turns: int) -> None:
    """For every count and any number of turns before, one more is one more."""
    last = np.array(reading) + turns * FIELD
    counts = np.empty(6, dtype=np.int64)
    following = np.array([(count + 1) % FIELD for count in reading])
    windows, still = np.full(6, FIELD), np.zeros(6)
    assert continue_counts(following, last, FIELD, windows, still, 1, 1, counts)
    assert (counts == last + 1).all()
