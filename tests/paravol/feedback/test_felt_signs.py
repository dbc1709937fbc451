"""What an operation feels reaches the signs, hand by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from anatomy.wall_layers import NO_FEEL, WallKind
from paravol.feedback.felt_signs import SOFT, break_forces_n, felt_signs
from paravol.feedback.touch_signs import Strain
from scenarios.feeling import FeltFigures
from scenarios.scoring import BreakFigure
from surgery.force import NO_TOUCH, Touch
from surgery.kernels.touch_force import TOUCHING
from tests.scenarios.recorded_hand import FLOOR_MM, Hand

HAZARD = ("orbit", 1.5)
LAMINA = "lamina papyracea"


def test_a_probe_that_presses_deeper_tells_more_until_the_wall_breaks() -> None:
    hand = Hand()
    limit_n = break_forces_n(hand.operation.patient.layers.kinds)[LAMINA]
    told = []
    for depth_mm in np.arange(-1.0, 5.0, 0.1):
        hand.tip_mm = (12.0, 11.0, FLOOR_MM - depth_mm)
        hand.step(after_s=0.02, name="ball probe")
        told.append(felt_signs(hand.operation, HAZARD, bites=3))
    assert {(signs.hazard, signs.bites) for signs in told} == {(HAZARD, 3)}
    assert told[0].force_n == 0.0
    assert told[0].strain is Strain.NONE
    whole = [signs for signs in told if signs.breaks == 0]
    forces = [signs.force_n or 0.0 for signs in whole]
    assert np.all(np.diff(forces) >= -1e-6)
    pressing = [signs for signs in whole if signs.share > 0.0]
    assert {(signs.wall, signs.limit_n) for signs in pressing} == {(LAMINA, limit_n)}
    assert pressing[-1].strain is Strain.BREAKING
    assert pressing[-1].share > 0.9
    after = told[-1]
    assert (after.breaks, after.broken) == (1, LAMINA)
    (broken,) = hand.operation.feeling.figures.breaks
    assert after.broken_n == broken.force_n >= 0.9 * limit_n


def pressing(newton: float, wall: str) -> Touch:
    return replace(NO_TOUCH, size_n=newton, wall=wall, flags=TOUCHING)


class _Felt:
    """An operation that has come to a moment."""

    def __init__(self, tool: Touch, scope: Touch, broken: tuple[str, ...] = ()) -> None:
        self.patient: Any = Hand().operation.patient
        self.feeling = self
        breaks = tuple(BreakFigure(1.0, wall, 9.0, "curette") for wall in broken)
        self.figures = FeltFigures(breaks=breaks)
        self.touch, self.scope_touch = tool, scope


def signs_of(*felt: Any) -> Any:
    operation: Any = _Felt(*felt)
    return felt_signs(operation, None, 0)


def test_the_hand_that_is_nearer_to_a_break_is_told() -> None:
    light, hard = pressing(1.0, LAMINA), pressing(3.0, LAMINA)
    assert signs_of(light, hard).force_n == 3.0
    assert signs_of(hard, light).force_n == 3.0
    assert signs_of(NO_TOUCH, light).force_n == 1.0
    # 2 N on a thin wall are nearer to a break than 3 N where nothing breaks
    assert signs_of(pressing(2.0, LAMINA), pressing(3.0, "")).wall == LAMINA
    assert signs_of(NO_TOUCH, pressing(3.0, "")).wall == SOFT
    assert signs_of(NO_TOUCH, NO_TOUCH).share == 0.0


def test_all_breaks_are_counted_and_the_last_is_named() -> None:
    signs = signs_of(NO_TOUCH, NO_TOUCH, (LAMINA, ""))
    assert (signs.breaks, signs.broken, signs.broken_n) == (2, "bone", 9.0)


@pytest.mark.parametrize("forces", [(6.0, 4.0), (4.0, 6.0)])
def test_of_walls_of_one_name_the_weakest_counts(forces: tuple[float, ...]) -> None:
    kinds = [WallKind("lamella", 1.0, 0.2, 10, 20, n, "", NO_FEEL) for n in forces]
    kinds.append(WallKind("", 1.0, 0.0, 10, 10, 0.0, "", NO_FEEL))
    kinds.append(WallKind("uncinate", 1.0, 0.0, 10, 10, 5.0, "", NO_FEEL))
    assert break_forces_n(tuple(kinds)) == {"lamella": 4.0}
