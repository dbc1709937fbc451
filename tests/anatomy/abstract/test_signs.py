"""Laws of painted signs: each differs, and reads from left to right."""

import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy.abstract.signs import HALF_MM, LETTERS, Sign

NORMAL, UP = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
ACROSS = np.linspace(-HALF_MM, HALF_MM, 41)


def _picture(letter: str, mirror: float = 1.0) -> NDArray[np.float64]:
    """Paint a sign on the wall behind; rows from the top, columns from the left."""
    sign = Sign(letter, np.zeros(3), NORMAL, UP)
    # looking along +y with +z up, the picture's right is +x
    x, z = np.meshgrid(mirror * ACROSS, ACROSS[::-1])
    places = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)
    return sign.paint(places, mirror, 0.2).reshape(x.shape)


def test_letters_stand_upright_and_read_from_left_to_right() -> None:
    middle = slice(8, 33)
    f = _picture("F")[middle, middle]
    assert f[:, :12].sum() > 1.5 * f[:, 13:].sum()
    assert f[:12].sum() > 1.5 * f[13:].sum()


@pytest.mark.parametrize("letter", LETTERS)
def test_a_letter_reads_alike_in_a_mirrored_space(letter: str) -> None:
    assert _picture(letter, -1.0) == pytest.approx(_picture(letter))


def test_no_two_letters_look_alike() -> None:
    pictures = [_picture(letter) for letter in LETTERS]
    for n, one in enumerate(pictures):
        for other in pictures[:n]:
            assert np.abs(one - other).mean() > 0.02


def test_a_sign_covers_its_square_on_the_wall_and_nothing_before_it() -> None:
    sign = Sign("A", np.array([1.0, 2.0, 3.0]), NORMAL, UP)
    on = np.array([[1, 2, 3], [1 + HALF_MM, 2, 3], [1, 3, 3]])
    off = np.array([[1.1 + HALF_MM, 2, 3], [1, 0, 3], [1, 2, 3.1 + HALF_MM]])
    assert sign.covers(on).all()
    assert not sign.covers(off).any()
