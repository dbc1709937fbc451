"""What is typed stands for the pedals that a tracker lacks."""

from collections.abc import Iterator

import numpy as np
import pytest

from devices import Pose
from paravol.inputs.typed_pedals import TAP_S, TypedPedals


class Poses:
    def __init__(self) -> None:
        self.given = 0

    def read(self, timeout_s: float) -> Pose:
        self.given += 1
        return Pose(0.1 * self.given, 0.0, np.eye(4), 0)


def _buttons(typed: list[str | None]) -> list[int]:
    said: Iterator[str | None] = iter(typed)
    pedals = TypedPedals(Poses(), lambda: next(said))
    return [pedals.read(1.0).buttons for _ in typed]


def test_enter_presses_the_right_pedal_and_lets_it_go() -> None:
    assert _buttons(["", "\n", "", "\n", "", "\n\n"]) == [0, 1, 1, 0, 0, 0]


def test_b_taps_the_left_pedal_and_lets_the_right_one_go() -> None:
    assert TAP_S == 0.2
    assert _buttons(["\n", "b\n", "", "", ""]) == [1, 2, 2, 0, 0]
    assert _buttons(["B \n"]) == [2]


def test_half_a_line_and_other_words_press_nothing() -> None:
    assert _buttons(["b", "", "\n", ""]) == [0, 0, 2, 2]
    assert _buttons(["hello\n", ""]) == [0, 0]


def test_where_nobody_can_type_it_says_so() -> None:
    with pytest.raises(ValueError, match="in a terminal"):
        _buttons([None])
