"""What force devices bear."""

import math

import pytest

from devices.haptics.force_port import SHARE, ForceLimits
from system import UserError


def test_a_wall_is_no_stiffer_than_the_devices_damping_bears() -> None:
    # 0.5 N s/m at 1 kHz begins to swing at 1000 N/m
    assert ForceLimits(3.0, 2000.0, 0.5).stiffest_n_m(1e-3) == SHARE * 1000.0
    assert ForceLimits(3.0, 2000.0, 0.5).stiffest_n_m(1e-4) == 2000.0
    assert ForceLimits(3.0, 300.0, 0.5).stiffest_n_m(1e-3) == 300.0
    # of a device whose damping nobody knows its maker's figure is taken
    assert ForceLimits(3.0, 300.0).stiffest_n_m(1e-3) == 300.0


@pytest.mark.parametrize(
    ("force_n", "stiffness_n_m", "damping_ns_m"),
    [(0, 1, 0), (1, 0, 0), (1, 1, -1), (math.nan, 1, 0), (1, math.inf, 0)],
)
def test_what_is_no_limit_is_refused(
    force_n: float, stiffness_n_m: float, damping_ns_m: float
) -> None:
    with pytest.raises(UserError, match="device's"):
        ForceLimits(force_n, stiffness_n_m, damping_ns_m)
