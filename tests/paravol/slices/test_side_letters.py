"""Letters name the side that is there, however a camera stands."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from paravol.slices.side_letters import (
    LEAST_SHARE,
    SIDES,
    TOGETHER_DEG,
    looks_towards,
    place_text,
    side_letters,
)
from renderers.scene import Camera

NAMED = {
    letter: sign * np.eye(3)[axis]
    for axis, ends in enumerate(SIDES)
    for sign, letter in zip((-1.0, 1.0), ends, strict=True)
}
"""Where each side lies: left is +x, the back +y, up +z."""

rotations = st.integers(0, 2**32 - 1).map(
    lambda seed: Rotation.random(random_state=seed).as_matrix()
)


def camera_of(turned: np.ndarray) -> Camera:
    right, up, forward = turned[0], turned[1], -turned[2]
    frame = np.stack([np.array([3.0, -4.0, 5.0]), right, up, forward])
    return Camera(frame, np.radians(60.0), 64, 64)


@given(rotations)
def test_a_letter_is_where_the_camera_sees_what_lies_on_that_side(
    turned: np.ndarray,
) -> None:
    """The first letter exactly; a second one within what joins them."""
    camera = camera_of(turned)
    eye, right, up, forward = camera.frame
    letters = side_letters(right, up)
    middle, _ = camera.project(eye + 20.0 * forward)
    for side in letters:
        at = np.array([side.x, side.y])
        assert np.linalg.norm(at) == pytest.approx(1.0)
        for number, letter in enumerate(side.letters):
            seen, _ = camera.project(eye + 20.0 * forward + NAMED[letter])
            way = (seen - middle) / np.linalg.norm(seen - middle)
            # fisheye lenses bend what is not seen straight on; the side stays
            least = 0.999 if number == 0 else np.cos(np.radians(TOGETHER_DEG))
            assert way @ at > least - 0.01


@given(rotations)
def test_what_lies_in_the_picture_is_lettered_and_nothing_twice(
    turned: np.ndarray,
) -> None:
    camera = camera_of(turned)
    _, right, up, forward = camera.frame
    text = "".join(side.letters for side in side_letters(right, up))
    assert len(set(text)) == len(text)
    for letter, way in NAMED.items():
        share = float(np.hypot(way @ right, way @ up))
        if abs(share - LEAST_SHARE) > 1e-9:
            assert (letter in text) == (share > LEAST_SHARE)
    towards = looks_towards(forward)
    assert towards[0] == max(NAMED, key=lambda letter: NAMED[letter] @ forward)
    # right and left are told by a letter at the rim or by where the scope looks
    assert {"R", "L"} & set(text + towards)


def test_a_mirrored_picture_would_be_told() -> None:
    """Upright, looking backwards into the nose: the patient's left is on the right."""
    right, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    placed = {side.letters: (side.x, side.y) for side in side_letters(right, up)}
    assert placed["L"] == pytest.approx((1.0, 0.0))
    assert placed["R"] == pytest.approx((-1.0, 0.0))
    assert placed["S"] == pytest.approx((0.0, -1.0))
    assert placed["I"] == pytest.approx((0.0, 1.0))
    # from behind it is the other way round
    placed = {side.letters: (side.x, side.y) for side in side_letters(-right, up)}
    assert placed["L"] == pytest.approx((-1.0, 0.0))


def test_a_place_is_told_by_its_sides() -> None:
    assert place_text((-12.34, 4.0, -0.5)) == "R 12.3 · P 4.0 · I 0.5 mm"
    assert place_text((1.0, -1.0, 1.0)) == "L 1.0 · A 1.0 · S 1.0 mm"
