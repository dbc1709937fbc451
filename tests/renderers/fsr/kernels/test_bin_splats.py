import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr.kernels.bin_splats import BATCH, bin_splats, make_bins, transpose
from renderers.fsr.kernels.project_splats import RECORD
from renderers.fsr.kernels.tile_buffer import ACROSS, SIDE


def squares_of_box(box_x: int, box_y: int, left: int, top: int) -> int:
    """Give the squares of a tile that a box of pixels meets, a bit each."""
    met = 0
    for k in range(ACROSS * ACROSS):
        x, y = left + k % ACROSS * SIDE, top + k // ACROSS * SIDE
        across = x + SIDE > box_x & 0xFFFF and x <= box_x >> 16
        down = y + SIDE > box_y & 0xFFFF and y <= box_y >> 16
        met |= (across and down) << k
    return met


def matrix(words: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Write words as rows of bits, the lowest first."""
    rows = words.view(np.uint8).reshape(-1, 8)
    return np.unpackbits(rows, axis=1, bitorder="little")


@given(
    words=st.lists(st.integers(-(2**63), 2**63 - 1), min_size=64, max_size=64),
    zeros=st.integers(0, 64),
)
def test_rows_of_bits_become_columns(words: list[int], zeros: int) -> None:
    given_ = np.array(words, np.int64)
    given_[64 - zeros :] = 0
    turned = given_.copy()
    transpose(turned, 0)
    np.testing.assert_array_equal(matrix(turned), matrix(given_).T)
    transpose(turned, 0)
    np.testing.assert_array_equal(turned, given_)


@given(seed=st.integers(0, 10**6), size=st.integers(0, 400), alive=st.integers(0, 64))
def test_every_live_square_gets_its_splats_once_and_in_order(
    seed: int, size: int, alive: int
) -> None:
    """Points: their boxes say all. Splats that no live square meets get no place."""
    rng = np.random.default_rng(seed)
    left, top = 64, 32
    corners = rng.integers(0, 32, (2, 2, size))
    corners.sort(axis=0)
    records = np.zeros((size + 16, RECORD), np.float32)
    boxes = np.zeros((size + 16, 4), np.int32)
    # boxes begin and end beyond the tile, too
    (x0, y0), (x1, y1) = corners + np.array([left, top])[:, None]
    x0, x1 = x0 - 40 * (x0 == left), x1 + 9 * (x1 == left + 31)
    boxes[:size, 0], boxes[:size, 1] = x0 | x1 << 16, y0 | y1 << 16
    items = np.zeros(size + 16, np.int32)
    items[:size] = rng.permutation(size)
    bits = np.arange(64) < alive
    rng.shuffle(bits)
    live = int(np.packbits(bits, bitorder="little").view(np.int64)[0])
    got: list[list[int]] = [[] for _ in range(64)]
    first, bins = 0, make_bins()
    while first < size:
        touched, times, first = bin_splats(
            records.reshape(-1), boxes, items[:size], first, left, top, np.int64(live),
            True, bins,
        )  # fmt: skip
        assert times <= BATCH // 64
        for k in range(64):
            dealt = matrix(bins.words[: 64 * times])[k::64].reshape(-1)
            assert bool(dealt.any()) == bool(touched >> k & 1)
            got[k] += (bins.offsets[np.flatnonzero(dealt)] // RECORD).tolist()
    rows = boxes[items[:size]]
    met = [squares_of_box(int(a), int(b), left, top) for a, b, _, _ in rows]
    for k in range(64):
        wanted = [
            s
            for s, squares in zip(items, met, strict=False)
            if bits[k] and squares >> k & 1
        ]
        assert got[k] == wanted
