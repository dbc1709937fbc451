import numpy as np
import pytest

from renderers.art import ActiveRayTracer, render_among
from renderers.scene import GBuffer
from tests.boards import KAPPA, METAL, SIZE, board, camera, slab


@pytest.fixture(scope="module")
def tracer() -> ActiveRayTracer:
    """A slab of 20 mm with its near face 30 mm before the eye."""
    return ActiveRayTracer(slab(21, 30.0), "final", threads=1)


@pytest.mark.parametrize("depth_mm", [10.0, 34.0, 40.0, 46.0])
def test_a_board_in_a_slab_is_seen_through_what_is_before_it(
    tracer: ActiveRayTracer, depth_mm: float
) -> None:
    image = render_among(tracer, camera(), board(depth_mm))
    right = slice(SIZE // 2, None)
    along = board(depth_mm).depth_mm[:, right].astype(np.float64)
    slant = camera().lens_table()[:, right, 2]
    before_mm = np.maximum(along - 30.0 / slant, 0.0)
    absorbed = -np.expm1(-KAPPA * before_mm)[..., None]
    # without a gradient the plain colour is 0.5
    wanted = 0.5 * absorbed + (1 - absorbed) * METAL
    assert np.abs(image.rgba[:, right, :3] - wanted).max() < 2e-5
    assert np.allclose(image.rgba[:, right, 3], 1, atol=1e-6)
    whole = -np.expm1(-KAPPA * 20 / camera().lens_table()[:, : SIZE // 2, 2])
    assert np.abs(image.rgba[:, : SIZE // 2, 3] - whole).max() < 2e-5
    assert image.depth_mm is not None
    assert np.all(image.depth_mm[:, right] <= along)


def test_behind_everything_it_changes_no_splat(tracer: ActiveRayTracer) -> None:
    alone = tracer.render(camera())
    image = render_among(tracer, camera(), board(500.0))
    left = slice(0, SIZE // 2)
    assert np.array_equal(image.rgba[:, left], alone.rgba[:, left])
    rest = 1 - alone.rgba[:, SIZE // 2 :, 3]
    added = image.rgba[:, SIZE // 2 :, 0] - alone.rgba[:, SIZE // 2 :, 0]
    assert np.allclose(added, rest * 0.55, atol=1e-6)


def test_without_solids_it_is_the_picture(tracer: ActiveRayTracer) -> None:
    alone = tracer.render(camera())
    image = render_among(tracer, camera(), GBuffer.empty(SIZE, SIZE))
    assert np.array_equal(image.rgba, alone.rgba)
    assert alone.depth_mm is not None
    assert image.depth_mm is not None
    assert np.array_equal(image.depth_mm, alone.depth_mm)


def test_a_buffer_of_another_size_is_refused(tracer: ActiveRayTracer) -> None:
    with pytest.raises(ValueError, match="48"):
        render_among(tracer, camera(), GBuffer.empty(8, 8))
