import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from benchmarks.nasal_views import acceptance_views, count_openings, path_views


def test_the_named_views_look_along_the_nose_through_a_round_field() -> None:
    views = acceptance_views(96)
    assert len({view.name for view in views}) == len(views) == 6
    for view in views:
        # into the head, upright
        assert view.camera.frame[3, 1] > 0.5
        assert view.camera.frame[2, 2] > 0.5
        assert view.camera.extent == pytest.approx(np.radians(44))
        # right nasal cavity: the patient's right is at negative x
        assert view.camera.eye_mm[0] < 0
    assert {view.head for view in views} == {"default", "operated"}


def test_path_views_are_evenly_spread_and_named_by_their_time() -> None:
    views = path_views(64, 5)
    assert [view.name for view in views] == [
        f"flight at {t} s" for t in ("2.5", "7.5", "12.5", "17.5", "22.5")
    ]


def plate(holes: list[tuple[int, int, int]]) -> np.ndarray:
    """A wall at 10 mm with round holes (row, column, radius), 20 mm behind them."""
    y, x = np.mgrid[:128, :128]
    depth = np.full((128, 128), 10.0, np.float32)
    for row, column, radius in holes:
        depth[(y - row) ** 2 + (x - column) ** 2 < radius**2] = 20
    return depth


def test_openings_are_counted_and_missed_where_they_are_closed() -> None:
    met = np.ones((128, 128), bool)
    truth = plate([(30, 30, 5), (90, 40, 7), (60, 100, 4)])
    assert count_openings(truth, truth, met) == (3, 0)
    assert count_openings(truth, plate([(30, 30, 4), (90, 40, 1)]), met) == (3, 2)
    # a passage wider than discs could close is none, nor is a speck
    assert count_openings(plate([(60, 60, 30), (20, 20, 1)]), truth, met) == (0, 0)


def test_what_is_not_to_be_judged_has_no_openings() -> None:
    truth = plate([(30, 30, 5)])
    met = np.ones((128, 128), bool)
    met[:64] = False
    assert count_openings(truth, gaussian_filter(truth, 3), met) == (0, 0)
