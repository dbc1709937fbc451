import numpy as np

from anatomy.tissue import (
    AIR_LABELS,
    LIVE_OVER_CADAVER,
    TISSUE_OF,
    TISSUES,
    Label,
    encode_blood,
)


def test_blood_is_stored_to_within_half_a_step() -> None:
    fractions = np.linspace(0, 1, 1001)
    root = encode_blood(fractions) / 255
    assert np.abs(root - np.sqrt(fractions)).max() <= 0.5 / 255 + 1e-12


def test_every_stored_value_survives() -> None:
    stored = np.arange(256, dtype=np.uint8)
    assert np.array_equal(encode_blood((stored / 255) ** 2), stored)


def test_labels_of_air_come_first() -> None:
    assert all(label in AIR_LABELS for label in Label if label <= 8)
    assert Label.MUCOSA not in AIR_LABELS
    assert len({label.value for label in Label}) == len(Label)


def test_every_label_has_a_tissue_and_thin_walls_break() -> None:
    assert set(TISSUE_OF) == set(Label)
    lamina = TISSUE_OF[Label.LAMINA_PAPYRACEA].fracture_n / LIVE_OVER_CADAVER
    assert lamina < TISSUE_OF[Label.FOVEA].fracture_n / LIVE_OVER_CADAVER / 2
    assert TISSUES["bone"].fracture_n == 0
    assert all(0 <= t.t1 <= 1 and 0 <= t.t2 <= 1 for t in TISSUES.values())
