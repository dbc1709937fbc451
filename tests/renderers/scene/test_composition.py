"""Several solids in one view, and pictures among them, whoever draws these."""

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderers import art, fsr
from renderers.scene import Camera, GBuffer, Image, Material
from renderers.scene.composition import solids_seen
from tests import boards
from tests.tools import board

CAMERA = Camera.looking_at(
    (1, -30, 2), (0, 0, 0), extent=math.radians(20), size=(40, 32)
)


def test_the_nearest_of_several_solids_is_seen_in_any_order() -> None:
    near, far = board(CAMERA, 10.0, 1.0), board(CAMERA, 20.0, 6.0)
    one, other = solids_seen(CAMERA, [near, far]), solids_seen(CAMERA, [far, near])
    alone = [mesh.gbuffer(CAMERA, pose) for mesh, pose in (near, far)]
    merged = alone[0].nearest(alone[1])
    for name in ("depth_mm", "normal", "coverage", "material"):
        assert_array_equal(getattr(one, name), getattr(other, name))
        assert_array_equal(getattr(one, name), getattr(merged, name))
    seen = one.coverage > 0
    assert_array_equal(np.unique(one.material[seen]), [Material.DARK_PLASTIC])
    close = one.depth_mm < 15
    assert 0 < close.sum() < seen.sum() < seen.size


def test_nothing_placed_is_nothing_seen() -> None:
    found, none = solids_seen(CAMERA, []), GBuffer.empty(32, 40)
    assert_array_equal(found.depth_mm, none.depth_mm)
    assert not found.coverage.any()


Among = Callable[[GBuffer], Image]


@pytest.fixture(scope="module", params=["rays", "splats"])
def drawn(request: pytest.FixtureRequest) -> Iterator[tuple[Image, Among]]:
    """A slab of 20 mm before the eye, alone, and what draws it among solids."""
    camera = boards.camera()
    if request.param == "rays":
        tracer = art.ActiveRayTracer(boards.slab(21, 30.0), "final", threads=1)
        alone = tracer.render(camera)
        yield alone, lambda solids: art.render_among(tracer, camera, solids)
        return
    scene = boards.slab(20, 30.5)
    shown = fsr.Inclusion.opacity(scene.transfer_function, 1.0)
    splats = fsr.FuzzySetRenderer(scene, inclusion=shown, threshold=0.0)
    alone = splats.render(camera, with_depth=True)
    yield alone, lambda solids: fsr.render_among(splats, camera, solids)
    splats.close()


def test_a_board_behind_everything_adds_what_light_is_left(
    drawn: tuple[Image, Among],
) -> None:
    alone, among = drawn
    image = among(boards.board(500.0))
    left, right = np.split(alone.rgba, 2, axis=1)
    assert_array_equal(image.rgba[:, : boards.SIZE // 2], left)
    added = image.rgba[:, boards.SIZE // 2 :, 0] - right[..., 0]
    np.testing.assert_allclose(added, (1 - right[..., 3]) * 0.55, atol=1e-6)


def test_without_solids_it_is_the_picture(drawn: tuple[Image, Among]) -> None:
    alone, among = drawn
    image = among(GBuffer.empty(boards.SIZE, boards.SIZE))
    assert_array_equal(image.rgba, alone.rgba)
    assert alone.depth_mm is not None
    assert image.depth_mm is not None
    assert_array_equal(image.depth_mm, alone.depth_mm)


def test_a_buffer_of_another_size_is_refused(drawn: tuple[Image, Among]) -> None:
    with pytest.raises(ValueError, match="48"):
        drawn[1](GBuffer.empty(8, 8))
