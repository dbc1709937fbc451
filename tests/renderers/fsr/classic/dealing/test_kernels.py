import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr.classic.dealing.kernels import transpose


def matrix(words: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Write words as rows of bits, the lowest first."""
    return np.unpackbits(words.view(np.uint8).reshape(64, 8), axis=1, bitorder="little")


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
