"""Laws of premultiplied pictures and of the one step to sRGB."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image as PngImage

from renderers.scene import Image, save_png, srgb_from_linear


def linear_from_srgb(encoded: NDArray[np.float64]) -> NDArray[np.float64]:
    """Invert the curve by its own two branches (IEC 61966-2-1)."""
    return np.where(
        encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4
    )


def test_encoding_inverts_the_standards_decoding() -> None:
    encoded = np.linspace(0, 1, 4001)
    found = srgb_from_linear(linear_from_srgb(encoded))
    np.testing.assert_allclose(found, encoded, atol=3e-7)


def test_every_screen_code_survives() -> None:
    codes = np.arange(256)
    linear = linear_from_srgb(codes / 255).astype(np.float32)
    rgba = np.ones((1, 256, 4), np.float32)
    rgba[0, :, :3] = linear[:, None]
    pixels = Image(rgba).to_srgb8()
    assert pixels.dtype == np.uint8
    assert np.array_equal(pixels[0], np.stack([codes] * 3, axis=1))


def test_encoding_clips_and_never_falls() -> None:
    ramp = srgb_from_linear(np.linspace(-1, 2, 9001))
    assert ramp.min() == 0
    assert 1 - 1e-7 < ramp.max() <= 1
    # The standard's rounded constants leave a jump of 3e-8 where the branches meet.
    assert np.all(np.diff(ramp) >= -1e-7)


@given(
    alpha=st.floats(0, 1, width=32),
    color=st.floats(0, 1, width=32),
    back=st.floats(0, 1, width=32),
)
def test_over_is_the_premultiplied_law(alpha: float, color: float, back: float) -> None:
    rgba = np.array([[[color * alpha] * 3 + [alpha]]], np.float32)
    expected = color * alpha + (1 - alpha) * back
    found = Image(rgba).over((back, back, back))
    np.testing.assert_allclose(found, expected, atol=3e-7)


@pytest.mark.parametrize(
    ("rgba", "depth"),
    [
        (np.zeros((2, 2, 3), np.float32), None),
        (np.zeros((2, 4), np.float32), None),
        (np.zeros((2, 2, 4)), None),
        (np.zeros((2, 2, 4), np.float32), np.zeros((2, 3), np.float32)),
    ],
)
def test_bad_pictures_are_refused(
    rgba: NDArray[np.float32], depth: NDArray[np.float32] | None
) -> None:
    with pytest.raises(ValueError, match=r"an image is|does not fit"):
        Image(rgba, depth)


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3)])
def test_png_gives_back_pixels_and_text(shape: tuple[int, ...], tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).integers(0, 256, shape).astype(np.uint8)
    path = tmp_path / "new folder" / "ein Bild.png"
    save_png(path, pixels, {"pose": "1 2 3", "Größe": "µm"})
    with PngImage.open(path) as image:
        assert np.array_equal(np.asarray(image), pixels)
        assert image.info["pose"] == "1 2 3"
        assert image.info["Größe"] == "µm"


def test_a_failed_save_leaves_the_old_picture_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    save_png(path, np.zeros((4, 4), np.uint8))
    before = path.read_bytes()
    with pytest.raises(TypeError):
        save_png(path, np.zeros((4, 4, 7), np.uint8))
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]
