"""Cavities compared: balls cut out of a block, whose distances are known."""

from typing import Any

import numpy as np
import pytest

from renderers.scene import Volume
from scenarios.metrics import Measured, Taken
from scenarios.metrics.cavity import CAVITY, Cavity, hausdorff_mm, mean_mm, overlap
from tests.scenarios.metrics.tracks import NO_TRACK, of_scope

SPACING = 0.5
AXIS = np.arange(-12.0, 12.0, SPACING)
BLOCK = Volume(
    np.full((len(AXIS),) * 3, 5.0, np.float32), np.full(3, SPACING), np.full(3, -12.0)
)


def ball(radius_mm: float, *middle_mm: float) -> Cavity:
    """Cut a ball out of the block."""
    z, y, x = np.meshgrid(AXIS, AXIS, AXIS, indexing="ij")
    away = np.sqrt(sum((a - m) ** 2 for a, m in zip((x, y, z), middle_mm, strict=True)))
    after = np.minimum(BLOCK.values, away - radius_mm).astype(np.float32)
    return Cavity.between(BLOCK, BLOCK.with_values(after, 5.0))


@pytest.mark.parametrize(("inner", "outer"), [(5.0, 8.0), (6.0, 7.0)])
def test_concentric_balls_are_apart_by_their_radii(inner: float, outer: float) -> None:
    one, other = ball(inner, 0, 0, 0), ball(outer, 0, 0, 0)
    assert mean_mm(one, other) == pytest.approx(outer - inner, abs=SPACING / 2)
    assert hausdorff_mm(one, other) == pytest.approx(outer - inner, abs=SPACING)
    # Dice of concentric balls
    dice = 2 * inner**3 / (inner**3 + outer**3)
    assert overlap(one, other) == pytest.approx(dice, abs=0.01)


def test_a_ball_that_is_shifted_lies_off_by_its_shift() -> None:
    one, other = ball(6.0, 0, 0, 0), ball(6.0, 2.0, 0, 0)
    assert hausdorff_mm(one, other) == pytest.approx(2.0, abs=SPACING / 2)
    # |cos| over a sphere is 1/2 on average
    assert mean_mm(one, other) == pytest.approx(1.0, abs=SPACING / 2)


def test_a_cavity_is_nowhere_from_itself_and_distances_are_mutual() -> None:
    one, other = ball(4.0, 1, 0, 2), ball(6.0, 0, 1, 0)
    assert mean_mm(one, one) == 0.0
    assert overlap(one, one) == 1.0
    assert mean_mm(one, other) == mean_mm(other, one)
    assert hausdorff_mm(one, other) == hausdorff_mm(other, one)


def measured(**more: Any) -> Measured:
    return of_scope(NO_TRACK, edits=(Taken(3.0, "curette", {"mucosa": 1.0}),), **more)


def test_the_metrics_say_what_they_lack() -> None:
    one, nothing = ball(4.0, 0, 0, 0), ball(0.0, 50.0, 0, 0)
    for definition in CAVITY:
        for lacking in (
            measured(),
            measured(cavity=one),
            measured(cavity=one, expert_cavity=nothing),
        ):
            (found,) = definition.answers(lacking).values()
            assert found.value is None
            assert found.reason
        both = measured(cavity=one, expert_cavity=one)
        (found,) = definition.answers(both).values()
        assert found.value == (1.0 if definition.unit == "1" else 0.0)
        assert found.intervals == ((3.0, 3.0),)
        if definition.unit == "mm":
            assert found.sigma == SPACING / 2
