import numpy as np

from anatomy.phantom.slivers import remove_slivers


def test_specks_go_and_large_pieces_stay() -> None:
    air = np.full((20, 20, 20), 1.0, dtype=np.float32)
    air[1:12, 1:12, 1:12] = -1.0
    air[14:19, 14:19, 14:19] = -0.5
    air[15, 2, 2] = -0.25
    part = np.zeros(air.shape, dtype=np.uint8)
    assert remove_slivers(air, part, 1.0) == 1
    assert air[15, 2, 2] == 0.25
    assert air[16, 16, 16] == -0.5
    assert np.all(air[1:12, 1:12, 1:12] == -1.0)


def test_one_airway_has_nothing_to_remove() -> None:
    air = np.full((5, 5, 5), -1.0, dtype=np.float32)
    assert remove_slivers(air, np.zeros(air.shape, dtype=np.uint8), 0.5) == 0


def test_a_piece_that_the_field_of_view_cuts_stays() -> None:
    air = np.full((20, 20, 20), 1.0, dtype=np.float32)
    air[1:12, 1:12, 1:12] = -1.0
    air[15, 15, 17:] = -0.25
    air[15, 2, 2] = -0.25
    assert remove_slivers(air, np.zeros(air.shape, dtype=np.uint8), 1.0) == 1
    assert air[15, 15, 19] == -0.25
    assert air[15, 2, 2] == 0.25
