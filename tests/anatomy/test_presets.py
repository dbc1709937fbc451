from collections.abc import Callable

import numpy as np
import pytest

from anatomy.presets import bone_transfer_function, classic_transfer_function
from anatomy.tissue import TISSUES
from renderers.scene import TransferFunction


def test_air_is_clear_and_mucosa_begins_at_the_half_value() -> None:
    preset = classic_transfer_function()
    assert preset.is_clear(-1000, -600)
    _, kappa = preset.evaluate(np.array([-600.0, -450.0, -300.0]))
    assert kappa[1] == pytest.approx((kappa[0] + kappa[2]) / 2)
    assert bone_transfer_function().is_clear(-1000, TISSUES["mucosa"].hu)


@pytest.mark.parametrize(
    ("preset", "low", "high"),
    [(classic_transfer_function, -600, 100), (bone_transfer_function, 60, 1500)],
)
def test_a_surface_has_one_colour_all_over_its_ramp(
    preset: Callable[[], TransferFunction], low: float, high: float
) -> None:
    """Else the voxels' distances from it would be drawn on it as bands."""
    color, kappa = preset().evaluate(np.linspace(low, high, 50))
    assert kappa[-1] > kappa[0]
    np.testing.assert_allclose(color, color[:1].repeat(50, axis=0), atol=1e-12)
