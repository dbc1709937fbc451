import numpy as np
import pytest

from renderers.fsr.kernels.bin_splats import FRAGMENT_BITS
from renderers.fsr.splats.picture_cost import PictureCost, StripCost


def strip(number: int, ticks: tuple[int, int, int, int, int]) -> StripCost:
    fragments = number << FRAGMENT_BITS
    return StripCost(10, 3, number, 5, fragments + 128, np.array(ticks), 0.5)


def test_strips_add_up_and_their_stages_share_their_seconds() -> None:
    strips = [strip(1, (4, 1, 1, 2, 0)), strip(2, (0, 0, 0, 6, 2))]
    cost = PictureCost(strips, 8, 0.125)
    assert cost.counters() == {
        "listed": 20,
        "visible": 10,
        "split": 2,
        "rows": 16,
        "culled rows": 10,
        "fragments": 4,
    }
    assert [one.waited_s for one in strips] == [0.0, 0.125]
    stages = cost.stage_s()
    assert stages.pop("view") == 0.125
    # waiting is no stage
    assert sum(stages.values()) == pytest.approx(0.5 - 0.125 / 2)
    assert stages == pytest.approx(
        {"cull": 0.125, "project": 0.03125, "order": 0.03125, "draw": 0.25}
    )


def test_culling_done_before_is_no_stage_and_a_clock_may_stand_still() -> None:
    stages = PictureCost([strip(1, (0, 0, 0, 0, 0))], 8).stage_s()
    assert stages == {"project": 0.0, "order": 0.0, "draw": 0.0}
