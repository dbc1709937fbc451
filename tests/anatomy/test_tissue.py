import numpy as np
import pytest

from anatomy.tissue import (
    AIR_LABELS,
    TISSUES,
    Label,
    bone_transfer_function,
    classic_transfer_function,
    decode_blood,
    encode_blood,
)


def test_blood_is_stored_to_within_half_a_step() -> None:
    fractions = np.linspace(0, 1, 1001)
    back = decode_blood(encode_blood(fractions))
    assert np.abs(np.sqrt(back) - np.sqrt(fractions)).max() <= 0.5 / 255 + 1e-12


def test_every_stored_value_survives() -> None:
    stored = np.arange(256, dtype=np.uint8)
    assert np.array_equal(encode_blood(decode_blood(stored)), stored)


def test_air_is_clear_and_mucosa_begins_at_the_half_value() -> None:
    preset = classic_transfer_function()
    assert preset.is_clear(-1000, -600)
    _, kappa = preset.evaluate(np.array([-600.0, -450.0, -300.0]))
    assert kappa[1] == pytest.approx((kappa[0] + kappa[2]) / 2)
    assert bone_transfer_function().is_clear(-1000, TISSUES["mucosa"].hu)


def test_labels_of_air_come_first() -> None:
    assert all(label in AIR_LABELS for label in Label if label <= 8)
    assert Label.MUCOSA not in AIR_LABELS
    assert len({label.value for label in Label}) == len(Label)
