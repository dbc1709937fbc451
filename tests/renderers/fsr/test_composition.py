import math
from collections.abc import Iterator

import numpy as np
import pytest

from renderers.fsr import FuzzySetRenderer, Inclusion
from renderers.fsr.classic import SplatMode
from renderers.fsr.composition import render_among
from renderers.scene import (
    Camera,
    GBuffer,
    Light,
    Material,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)

SIZE = 48
KAPPA = 0.05


@pytest.fixture(scope="module")
def renderer() -> Iterator[FuzzySetRenderer]:
    """A slab of 20 mm with its near face 30 mm before the eye."""
    volume = Volume(
        np.zeros((41, 20, 41), np.int16), np.ones(3), np.array([-20.0, 30.5, -20.0])
    )
    transfer = TransferFunction(
        np.array([-1.0, 1.0]), np.full((2, 3), 0.5), np.full(2, KAPPA)
    )
    light = Light(np.array([0.0, -1.0, 0.0]), np.ones(3))
    scene = Scene(volume, transfer, (light,), PhongMaterial(0.2, 0.8, 0.0))
    made = FuzzySetRenderer(
        scene,
        inclusion=Inclusion.opacity(transfer, 1.0),
        threshold=0.0,
        mode=SplatMode.SHEET,
    )
    yield made
    made.close()


def camera() -> Camera:
    return Camera.looking_at(
        (0, 0, 0),
        (0, 1, 0),
        extent=math.radians(10),
        size=(SIZE, SIZE),
        projection=Projection.PERSPECTIVE,
    )


def board(depth_mm: float) -> GBuffer:
    """A metal board facing the eye, on the right half of the picture."""
    solids = GBuffer.empty(SIZE, SIZE)
    right = slice(SIZE // 2, None)
    axis = camera().lens_table()[:, right, 2]
    solids.depth_mm[:, right] = depth_mm / axis
    solids.normal[:, right] = (0, -1, 0)
    solids.coverage[:, right] = 1
    solids.material[:, right] = Material.METAL
    return solids


@pytest.mark.parametrize("depth_mm", [10.0, 34.0, 40.0, 46.0])
def test_a_board_in_a_slab_is_seen_through_what_is_before_it(
    renderer: FuzzySetRenderer, depth_mm: float
) -> None:
    image = render_among(renderer, camera(), board(depth_mm))
    middle = image.rgba[SIZE // 4 : -SIZE // 4]
    left, right = middle[:, 6 : SIZE // 2 - 2], middle[:, SIZE // 2 + 2 : -6]
    before_mm = max(depth_mm - 30.0, 0.0)
    absorbed = -math.expm1(-KAPPA * before_mm)
    metal = np.array([0.55, 0.56, 0.58])  # lit by one light from the eye: 0.2 + 0.8
    # the plain colour of splats without a gradient is 0.5
    wanted = 0.5 * absorbed + (1 - absorbed) * metal
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
