import numpy as np
import pytest

from anatomy.presets import bone_transfer_function, classic_transfer_function
from anatomy.tissue import TISSUES


def test_air_is_clear_and_mucosa_begins_at_the_half_value() -> None:
    preset = classic_transfer_function()
    assert preset.is_clear(-1000, -600)
    _, kappa = preset.evaluate(np.array([-600.0, -450.0, -300.0]))
    assert kappa[1] == pytest.approx((kappa[0] + kappa[2]) / 2)
    assert bone_transfer_function().is_clear(-1000, TISSUES["mucosa"].hu)
