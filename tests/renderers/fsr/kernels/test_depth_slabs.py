import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from renderers.fsr.kernels.depth_slabs import SPAN, find_waiting
from renderers.fsr.kernels.tile_buffer import ACROSS, BLOCKS


@given(
    down=st.integers(1, 3),
    across=st.integers(1, 3),
    seed=st.integers(0, 10**6),
    share=st.sampled_from([0.0, 0.02, 0.3, 1.0]),
)
def test_a_set_of_blocks_waits_where_any_of_its_squares_does(
    down: int, across: int, seed: int, share: float
) -> None:
    rng = np.random.default_rng(seed)
    squares = rng.random((down * ACROSS, across * ACROSS)) < share
    tiled = squares.reshape(down, ACROSS, across, ACROSS).swapaxes(1, 2)
    packed = np.packbits(tiled.reshape(-1, 64), axis=1, bitorder="little")
    alive = packed.view(np.int64).reshape(-1)
    shapes = [(BLOCKS * down + 2, BLOCKS * across + 2), (down + 2, across + 2)]
    sizes = [a * b for a, b in shapes]
    waiting = np.empty(sum(sizes), np.int32)
    find_waiting(alive, down, across, waiting)
    for shape, found in zip(shapes, np.split(waiting, sizes[:1]), strict=True):
        side = squares.shape[0] // (shape[0] - 2)
        one = np.zeros((shape[0] + SPAN, shape[1] + SPAN), bool)
        blocks = squares.reshape(shape[0] - 2, side, shape[1] - 2, side)
        one[1 : shape[0] - 1, 1 : shape[1] - 1] = blocks.any(axis=(1, 3))
        for b, a in np.ndindex(*shape):
            bits = [
                one[b : b + d + 1, a : a + r + 1].any()
                for d in range(SPAN)
                for r in range(SPAN)
            ]
            word = sum(int(bit) << n for n, bit in enumerate(bits))
            assert found.reshape(shape)[b, a] == word
