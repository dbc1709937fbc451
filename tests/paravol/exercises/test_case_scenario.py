"""The path of an exercise stays in air, or there is none."""

import numpy as np
import pytest

from anatomy.scan.approach import Approach, air_reach
from paravol.exercises.case_scenario import BEFORE_MM, straight_path
from renderers.scene.volume import Volume


def corridor(front_mm: float, back_mm: float) -> Volume:
    """A tube of 3 mm along y, closed at its front and back."""
    axes = [np.arange(-8.0, 8.1, 0.5), np.arange(-30.0, 60.1, 0.5)]
    z, y, x = np.meshgrid(axes[0], axes[1], axes[0], indexing="ij")
    distance = np.maximum(np.hypot(x, z) - 3, np.maximum(front_mm - y, y - back_mm))
    return Volume(
        distance.astype(np.float32),
        np.full(3, 0.5),
        np.array([-8.0, -30, -8]),
        background=6.0,
    )


WAY = np.array([0.0, 1, 0])


@pytest.mark.parametrize("front_mm", [-30.0, -20.0, -5.0, -1.0])
@pytest.mark.parametrize("back_mm", [10.0, 40.0])
def test_the_tip_goes_through_no_tissue(front_mm: float, back_mm: float) -> None:
    distance = corridor(front_mm, back_mm)
    # a way that claims more than there is
    path = straight_path(Approach(np.zeros(3), WAY, 50.0), distance)
    dense = np.concatenate(
        [
            np.linspace(a, b, 20)
            for a, b in zip(path.tip_mm, path.tip_mm[1:], strict=False)
        ]
    )
    assert distance.sample(dense).max() < 0
    assert dense[:, 1].min() == pytest.approx(max(front_mm, -BEFORE_MM), abs=0.21)
    assert dense[:, 1].max() == pytest.approx(min(back_mm, 48.0), abs=0.21)


def test_a_way_without_air_is_refused() -> None:
    distance = corridor(-1.0, 2.0)
    way = Approach(np.zeros(3), WAY, 40.0)
    with pytest.raises(ValueError, match=r"meets tissue after 1\.\d mm.*--pivot x y z"):
        straight_path(way, distance)


def test_beyond_the_volume_nothing_is_in_the_way() -> None:
    distance = corridor(-40.0, 40.0)
    assert air_reach(distance, np.zeros(3), -WAY, 80.0) == 80.0
    assert air_reach(distance, np.zeros(3), WAY, 80.0) == pytest.approx(40, abs=0.11)
    assert air_reach(distance, np.array([5.0, 0, 0]), WAY, 80.0) == 0.0
