import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.shading.bands import RowBands


@given(rows=st.integers(0, 70), threads=st.integers(1, 4), bands=st.integers(1, 5))
def test_every_row_is_covered_once(rows: int, threads: int, bands: int) -> None:
    counts = [0] * rows
    guard = threading.Lock()

    def kernel(first: int, last: int) -> None:
        with guard:
            for row in range(first, last):
                counts[row] += 1

    shared = RowBands(threads, bands)
    shared.run(rows, kernel)
    shared.close()
    assert counts == [1] * rows


@given(rows=st.integers(0, 200), least=st.integers(1, 60))
def test_bands_are_no_smaller_than_asked(rows: int, least: int) -> None:
    sizes: list[int] = []
    shared = RowBands(2)
    shared.run(rows, lambda first, last: sizes.append(last - first), least)
    shared.close()
    assert sum(sizes) == rows
    assert len(sizes) == 1 or min(sizes) >= least
    assert len(sizes) == 1 or len(sizes) % 2 == 0


def test_no_threads_and_no_bands_are_refused() -> None:
    with pytest.raises(ValueError, match="at least one thread, got 0"):
        RowBands(0)
    with pytest.raises(ValueError, match="positive, got 0"):
        RowBands(2, bands_per_thread=0)


@pytest.mark.parametrize("threads", [1, 2])
def test_every_row_that_is_begun_is_done_once(threads: int) -> None:
    bands = RowBands(threads)
    for height in (1, 2, 3, 50):
        counts = [0] * height

        def kernel(first: int, last: int, counts: list[int] = counts) -> None:
            for row in range(first, last):
                counts[row] += 1

        assert bands.begin(height, kernel, counts.copy).result() == [1] * height
    bands.close()


@pytest.mark.parametrize("threads", [1, 2])
def test_what_fails_at_last_is_raised_by_the_future(threads: int) -> None:
    bands = RowBands(threads)

    def fail(*_: object) -> None:
        raise OSError("the disk is full")

    for kernel, then in ((lambda first, last: None, fail), (fail, list)):
        with pytest.raises(OSError, match="disk is full"):
            bands.begin(8, kernel, then).result()
    bands.close()
