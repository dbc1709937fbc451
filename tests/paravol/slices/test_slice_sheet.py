"""What a sheet of slices shows beside the CT: outlines, tints, and their legend."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from app.__main__ import main
from paravol.slices.slice_sheet import OUTLINE_SHARE, TINT_SHARE, label_colors, marked

GRAY = np.full((12, 14, 3), 120, np.uint8)


def square() -> NDArray[np.uint8]:
    """A label of 6 x 7 pixels on no label."""
    labels = np.zeros(GRAY.shape[:2], np.uint8)
    labels[3:9, 4:11] = 21
    return labels


def mixed(share: float) -> NDArray[np.float64]:
    color: NDArray[np.float64] = label_colors()[21]
    return np.asarray(120 + share * (color - 120))


def test_an_outline_is_one_pixel_wide_and_leaves_the_inside() -> None:
    found = marked(GRAY, square(), "outlines")
    changed = np.any(found != GRAY, axis=2)
    wanted = square() > 0
    wanted[4:8, 5:10] = False
    assert np.array_equal(changed, wanted)
    np.testing.assert_allclose(found[3, 4], mixed(OUTLINE_SHARE), atol=0.51)


def test_a_tint_is_light_and_keeps_the_picture_below() -> None:
    step = GRAY.copy()
    step[:, 7:] = 180
    found = marked(step, square(), "tint").astype(int)
    np.testing.assert_allclose(found[5, 5], mixed(TINT_SHARE), atol=0.51)
    assert np.array_equal(found[0], step[0])
    rise = found[5, 8] - found[5, 5]
    np.testing.assert_allclose(rise, 60 * (1 - TINT_SHARE), atol=1)


def test_colours_are_apart_and_seen_on_black() -> None:
    colors = label_colors()
    assert colors.min() >= 0
    assert colors.max() <= 255
    assert colors.max(axis=1).min() > 120
    for first in range(1, 60):
        near = colors[first + 1 : first + 24] - colors[first]
        assert np.linalg.norm(near, axis=1).min() > 20


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("slices") / "case"
    words = ["phantom", "--out", str(folder), "--spacing", "2.0", "--json"]
    assert main(words) == 0
    return folder


def sheet(case: Path, *words: str) -> NDArray[np.int64]:
    out = case.parent / "sheet.png"
    assert main(["slices", str(case), "--out", str(out), *words]) == 0
    return np.asarray(Image.open(out)).astype(int)


def test_the_ct_is_read_under_outlines_and_a_legend_names_them(case: Path) -> None:
    bare = sheet(case, "--labels", "none")
    outlined, tinted = sheet(case), sheet(case, "--labels", "tint")
    high, wide, _ = bare.shape
    assert high == wide
    changed = np.any(outlined[:high] != bare, axis=2)
    # three panels of four show labels; most of their pixels stay as they were
    assert 0.01 < changed.mean() < 0.25
    assert np.any(tinted[:high] != bare, axis=2).mean() > 2 * changed.mean()
    legend = outlined[high:]
    assert legend.shape[0] > 40
    assert np.array_equal(legend, tinted[high:])
    # every colour in the planes has its swatch
    swatches = {tuple(c) for c in legend.reshape(-1, 3).tolist()}
    known = {tuple(c) for c in np.rint(label_colors()).astype(int)[1:80].tolist()}
    assert len(swatches & known) > 8
