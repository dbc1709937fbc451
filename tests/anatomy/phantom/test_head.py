"""The outside of the whole head: bounded, of a person's size, and the old face."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import ndimage

from anatomy.phantom.head import (
    NECK_END_MM,
    WHOLE_HEAD_MM,
    _bounds,
    _chin,
    _ears,
    _mouth,
    head_outside,
    outside,
)
from anatomy.phantom.lattice import DEFAULT_FIELD_MM, Box
from anatomy.phantom.lower_face import mandible
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import Phantom, build_phantom
from anatomy.phantom.shapes import Field
from anatomy.tissue import Label

STEP_MM = 3.0


def grid(box: Box, step_mm: float) -> np.ndarray:
    """Give points ``(3, nz, ny, nx)`` RAS of a box in LPS."""
    x, y, z = (np.arange(low, high + 1e-9, step_mm) for low, high in box)
    zz, yy, xx = np.meshgrid(z, y, x, indexing="ij")
    return np.stack([-xx, -yy, zz])


@pytest.fixture(scope="module")
def inside() -> np.ndarray:
    places = grid(WHOLE_HEAD_MM, STEP_MM)
    values = head_outside().evaluate(places.reshape(3, -1))
    return np.asarray(values.reshape(places.shape[1:]) > 0)


@pytest.fixture(scope="module")
def wide() -> Phantom:
    return build_phantom(PhantomParameters(), 3.0, field_mm=WHOLE_HEAD_MM)


def border(values: np.ndarray) -> np.ndarray:
    """Give all values on the six faces of a volume."""
    ends = [np.take(values, [0, -1], axis=axis).ravel() for axis in range(3)]
    return np.concatenate(ends)


def test_the_face_of_a_sinus_scan_is_what_it_was_to_the_bit() -> None:
    places = grid(DEFAULT_FIELD_MM, 1.5).reshape(3, -1)
    face, head = outside().evaluate(places), head_outside().evaluate(places)
    # The air function is clamped 3 mm behind the surface.
    near = face < 3.0
    assert np.count_nonzero(np.abs(face) < 3.0) > 10_000
    assert np.array_equal(face[near], head[near])
    assert np.all(head[~near] >= 3.0)


def test_the_head_is_one_bounded_piece_of_a_persons_size(inside: np.ndarray) -> None:
    _, count = ndimage.label(inside)
    assert count == 1
    assert not border(inside).any()
    extents = [
        STEP_MM * np.count_nonzero(inside.any(axis=others))
        for others in ((0, 1), (0, 2), (1, 2))
    ]
    breadth, length, height = extents
    # With ears and nose; menton to vertex is 215 to 245 mm without the neck.
    assert 140 < breadth < 185
    assert 185 < length < 225
    skull = height - (-68.0 - NECK_END_MM)
    assert 205 < skull < 245


@pytest.mark.parametrize("part", [_bounds, _chin, _ears, _mouth])
def test_each_side_of_the_nose_sees_the_whole_outside(
    part: Callable[[], Field],
) -> None:
    # The air of both sides is united: an ear that one side did not see were air.
    places = grid(WHOLE_HEAD_MM, 5.0).reshape(3, -1)
    mirrored = places * np.array([[-1.0], [1.0], [1.0]])
    here, there = (part().evaluate(p) for p in (places, mirrored))
    assert here == pytest.approx(there, abs=1e-9)


def test_nothing_of_the_head_reaches_the_border_of_a_wide_field(wide: Phantom) -> None:
    assert set(border(wide.labels.values)) == {int(Label.OUTSIDE_AIR)}
    assert np.all(border(wide.distance.values) < 0)
    assert np.all(border(wide.ct.values) == -1000)


def test_every_way_out_of_the_brain_leads_through_bone(wide: Phantom) -> None:
    rng = np.random.default_rng(3)
    ways = rng.normal(size=(300, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    ways[:, 2] = np.abs(ways[:, 2])
    middle = np.array([0.0, 90.0, 85.0])
    line = middle + ways[:, None, :] * np.arange(0.0, 130.0, 1.5)[:, None]
    hu = wide.ct.sample(line.reshape(-1, 3)).reshape(line.shape[:2])
    assert np.all(np.abs(hu[:, 0] - 35) < 30)
    assert np.all(hu.max(axis=1) > 400)
    assert np.all(hu[:, -1] < -900)


def test_the_jaw_lies_under_the_skin() -> None:
    places = grid(WHOLE_HEAD_MM, STEP_MM).reshape(3, -1)
    places[0] = np.abs(places[0])
    bone = mandible().evaluate(places) < 0
    assert np.count_nonzero(bone) > 500
    assert head_outside().evaluate(places)[bone].min() > 1.5
