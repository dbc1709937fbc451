"""Slices of a head in which every voxel tells its place."""

import numpy as np
import pytest

from anatomy.scan.histogram import Peaks, transfer_of
from paravol.slices.slice_views import (
    CT_WINDOW_HU,
    GRAY_WINDOWS,
    Plane,
    Show,
    SliceViews,
    cut,
)
from renderers.scene import Volume

SHAPE = (9, 10, 11)
ORIGIN, SPACING = np.array([-20.0, 5.0, 40.0]), np.full(3, 0.5)
TRANSFER = transfer_of(Peaks(-1000.0, 40.0, 15.0, 700.0))


def numbered() -> Volume:
    return Volume(np.arange(990, dtype=np.int16).reshape(SHAPE), SPACING, ORIGIN)


def at(i: int, j: int, k: int) -> np.ndarray:
    return ORIGIN + 0.5 * np.array([i, j, k])


@pytest.mark.parametrize("plane", Plane)
def test_a_point_is_at_its_place_in_every_plane(plane: Plane) -> None:
    volume = numbered()
    views = SliceViews.of({"ct": volume}, TRANSFER)
    for i, j, k in ((0, 0, 0), (10, 9, 8), (3, 7, 2)):
        column, row = views.place(plane, at(i, j, k))
        found = cut(volume, plane, at(i, j, k))
        assert found[round(row), round(column)] == volume.values[k, j, i]


def test_right_hangs_on_the_left_and_the_face_too() -> None:
    """A step to the patient's left goes to the right of the picture, up goes up."""
    views = SliceViews.of({"ct": numbered()}, TRANSFER)
    steps = {
        Plane.AXIAL: ((1, 0, 0), (0, 1, 0)),
        Plane.CORONAL: ((1, 0, 0), (0, 0, -1)),
        Plane.SAGITTAL: ((0, 1, 0), (0, 0, -1)),
    }
    for plane, (right, down) in steps.items():
        here = np.array(views.place(plane, at(5, 5, 5)))
        for step, expected in ((right, (1, 0)), (down, (0, 1))):
            there = np.array(views.place(plane, at(5, 5, 5) + 0.5 * np.array(step)))
            assert there - here == pytest.approx(expected)
    assert Plane.AXIAL.letters[:2] == ("R", "L")
    assert Plane.SAGITTAL.letters == ("A", "P", "S", "I")


def test_bone_of_the_ct_covers_the_mr_and_nothing_else_does() -> None:
    ct = np.full(SHAPE, 40, np.int16)
    ct[:, :, :4] = -1000
    ct[:, :, 8:] = 1700
    mr = np.linspace(0, 1, 990, dtype=np.float32).reshape(SHAPE)
    volumes = {
        "ct": Volume(ct, SPACING, ORIGIN),
        "t1": Volume(mr, SPACING, ORIGIN, background=0.0),
    }
    views = SliceViews.of(volumes, TRANSFER)
    middle = at(5, 5, 5)
    both = views.picture(Plane.AXIAL, middle, Show.BOTH)
    alone = views.picture(Plane.AXIAL, middle, Show.MR)
    assert np.array_equal(both[:, :8], alone[:, :8])
    # ivory: bright, and warmer than gray
    bone = both[:, 9].astype(int)
    assert (bone[:, 0] > 200).all()
    assert (bone[:, 0] > bone[:, 2]).all()
    assert np.unique(alone[..., 0]).size > 20
    gray = views.picture(Plane.AXIAL, middle, Show.CT)
    low, high = CT_WINDOW_HU
    assert (gray[0, 0] == 0).all()
    assert gray[0, 5, 0] == round(255 * (40 - low) / (high - low))


def test_the_switch_goes_round() -> None:
    kinds = [Show.CT]
    for _ in range(3):
        kinds.append(kinds[-1].next())
    assert kinds == [Show.CT, Show.MR, Show.BOTH, Show.CT]


def test_without_a_second_scan_it_is_asked_for() -> None:
    views = SliceViews.of({"ct": numbered()}, TRANSFER)
    with pytest.raises(ValueError, match="import it with --second"):
        views.picture(Plane.AXIAL, at(1, 1, 1), Show.BOTH)


@pytest.mark.parametrize("plane", Plane)
def test_what_is_found_at_a_place_of_a_picture_is_the_point(plane: Plane) -> None:
    views = SliceViews.of({"ct": numbered()}, TRANSFER)
    for point in (at(0, 0, 0), at(10, 9, 8), at(3, 7, 2) + 0.1):
        found = views.found(plane, *views.place(plane, point), point)
        assert found == pytest.approx(point)
    outside = views.found(plane, -50.0, 500.0, at(3, 3, 3))
    assert np.array_equal(views.within(outside), outside)


def test_a_step_goes_one_slice_and_stays_in_the_scan() -> None:
    views = SliceViews.of({"ct": numbered()}, TRANSFER)
    for number, plane in enumerate(Plane):
        moved = views.stepped(plane, at(3, 3, 3), 1) - at(3, 3, 3)
        assert moved.tolist() == [0.5 if 2 - number == axis else 0 for axis in range(3)]
    assert views.stepped(Plane.AXIAL, at(3, 3, 3), 99) == pytest.approx(at(3, 3, 8))


def test_a_window_is_black_below_and_white_above_its_ends() -> None:
    ct = np.full(SHAPE, -2000, np.int16)
    values = [-651, -649, 350, 1349, 1351]
    ct[4, 4, :5] = values
    views = SliceViews.of({"ct": Volume(ct, SPACING, ORIGIN)}, TRANSFER)
    (bone,) = (window for window in GRAY_WINDOWS if window.name == "bone")
    assert (bone.width, bone.level) == (2000.0, 350.0)
    row = views.picture(Plane.AXIAL, at(4, 4, 4), Show.CT, bone.ends)[4, :5, 0]
    assert row.tolist() == [0, 0, 128, 255, 255]
    assert GRAY_WINDOWS[0].ends == CT_WINDOW_HU
    moved = bone.moved(-1e9, 1e9)
    assert moved.ends[1] > moved.ends[0]
