import numpy as np
import pytest

from renderers.fsr.classic.kernels import FRAGMENT_BITS
from renderers.fsr.classic.picture_cost import PictureCost, StripCost


def strip(number: int, ticks: tuple[int, int, int]) -> StripCost:
    fragments = number << FRAGMENT_BITS
    return StripCost(10, 3, number, 5, fragments + 128, np.array(ticks), 0.5)


def test_strips_add_up_and_their_stages_share_their_seconds() -> None:
    cost = PictureCost([strip(1, (1, 1, 2)), strip(2, (0, 0, 7))], 8, 0.125, 0.25)
    assert cost.counters() == {
        "listed": 20,
        "visible": 10,
        "split": 2,
        "rows": 16,
        "culled rows": 10,
        "fragments": 4,
    }
    stages = cost.stage_s()
    assert stages.pop("view") == 0.125
    assert stages.pop("cull") == 0.25
    assert sum(stages.values()) == pytest.approx(0.5)
    assert stages == pytest.approx({"project": 0.0625, "order": 0.0625, "draw": 0.375})


def test_culling_done_before_is_no_stage_and_a_clock_may_stand_still() -> None:
    stages = PictureCost([strip(1, (0, 0, 0))], 8).stage_s()
    assert stages == {"project": 0.0, "order": 0.0, "draw": 0.0}
