import math
from collections.abc import Iterator

import numpy as np
import pytest

from renderers.fsr import FuzzySetRenderer, Inclusion, render_among
from renderers.scene import GBuffer
from tests.boards import KAPPA, METAL, SIZE, board, camera, slab


@pytest.fixture(scope="module")
def renderer() -> Iterator[FuzzySetRenderer]:
    """A slab of 20 mm with its near face 30 mm before the eye."""
    scene = slab(20, 30.5)
    made = FuzzySetRenderer(
        scene,
        inclusion=Inclusion.opacity(scene.transfer_function, 1.0),
        threshold=0.0,
    )
    yield made
    made.close()


@pytest.mark.parametrize("depth_mm", [10.0, 34.0, 40.0, 46.0])
def test_a_board_in_a_slab_is_seen_through_what_is_before_it(
    renderer: FuzzySetRenderer, depth_mm: float
) -> None:
    image = render_among(renderer, camera(), board(depth_mm))
    middle = image.rgba[SIZE // 4 : -SIZE // 4]
    left, right = middle[:, 6 : SIZE // 2 - 2], middle[:, SIZE // 2 + 2 : -6]
    before_mm = max(depth_mm - 30.0, 0.0)
    absorbed = -math.expm1(-KAPPA * before_mm)
    # the plain colour of splats without a gradient is 0.5
    wanted = 0.5 * absorbed + (1 - absorbed) * METAL
    # half a layer of splats at the board is on either side of it
    assert np.abs(right[..., :3].mean(axis=(0, 1)) - wanted).max() < 0.02
    assert np.allclose(right[..., 3], 1, atol=1e-6)
    whole = -math.expm1(-KAPPA * 20)
    assert left[..., 3].mean() == pytest.approx(whole, abs=0.02)
    depth = image.depth_mm
    assert depth is not None
    assert np.all(depth[:, SIZE // 2 :] <= board(depth_mm).depth_mm[:, SIZE // 2 :])


def test_behind_everything_it_changes_no_splat(renderer: FuzzySetRenderer) -> None:
    alone = renderer.render(camera(), with_depth=True)
    image = render_among(renderer, camera(), board(500.0))
    left = slice(0, SIZE // 2)
    assert np.array_equal(image.rgba[:, left], alone.rgba[:, left])
    rest = 1 - alone.rgba[:, SIZE // 2 :, 3]
    added = image.rgba[:, SIZE // 2 :, 0] - alone.rgba[:, SIZE // 2 :, 0]
    assert np.allclose(added, rest * 0.55, atol=1e-6)


def test_without_solids_it_is_the_picture(renderer: FuzzySetRenderer) -> None:
    alone = renderer.render(camera(), with_depth=True)
    image = render_among(renderer, camera(), GBuffer.empty(SIZE, SIZE))
    assert np.array_equal(image.rgba, alone.rgba)
    assert alone.depth_mm is not None
    assert image.depth_mm is not None
    assert np.array_equal(image.depth_mm, alone.depth_mm)


def test_a_buffer_of_another_size_is_refused(renderer: FuzzySetRenderer) -> None:
    with pytest.raises(ValueError, match="do not fit a picture of 48 x 48"):
        render_among(renderer, camera(), GBuffer.empty(8, 8))
