import numpy as np
import pytest

from renderers.fsr import Inclusion, extract_fuzzy_set
from renderers.fsr.splats import SplatRasterizer
from renderers.scene import Camera, Light, Projection, Scene, TransferFunction, Volume
from renderers.scene.thread_pool import ThreadPool
from tests.renderers.fsr.plain_splats import orthographic_picture
from tests.renderers.fsr.splat_scenes import above, blob, slab, unlit
from tests.slow_cases import slow


def test_a_local_light_far_away_equals_an_infinite_one(pool: ThreadPool) -> None:
    fuzzy, scene = blob()
    direction = np.array([0.48, 0.6, 0.64])
    color = np.array([0.9, 0.7, 0.5])
    camera = Camera.looking_at((5, -12, 9), (5, 5, 4), size=(48, 48))
    pictures = [
        SplatRasterizer(
            fuzzy, Scene(scene.volume, scene.transfer_function, (light,))
        ).draw(camera, pool)
        for light in (
            Light(direction, color),
            Light(1e6 * direction, color, is_local=True),
        )
    ]
    np.testing.assert_allclose(pictures[0].rgba, pictures[1].rgba, atol=1e-4)


@pytest.mark.parametrize("projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE])
def test_a_wall_third_of_a_millimetre_ahead_is_opaque(
    pool: ThreadPool, projection: Projection
) -> None:
    values = np.zeros((24, 24, 24), np.float32)
    values[:, 12:] = 100
    volume = Volume(values, np.full(3, 0.4), np.zeros(3))
    drawer = SplatRasterizer(*unlit(volume, 12.0))
    # the outermost voxels are boxes that end 0.2 mm before their centres
    wall = 12 * 0.4 - 0.2
    camera = Camera.looking_at(
        (4.6, wall - 0.3, 4.6),
        (4.6, 9.0, 4.6),
        extent=0.7,
        size=(96, 96),
        projection=projection,
    )
    image = drawer.draw(camera, pool, with_depth=True)
    assert drawer.counters["subdivided"] > 0
    assert np.all(np.isfinite(image.rgba))
    assert image.rgba[..., 3].min() >= 0.99
    assert image.depth_mm is not None
    assert 0.1 < image.depth_mm[48, 48] < 0.8


def test_leaving_out_what_has_no_light_changes_less_than_that_light(
    pool: ThreadPool,
) -> None:
    fuzzy, scene = blob()
    camera = Camera.looking_at((5, -12, 6), (5, 5, 4), extent=0.4, size=(90, 90))
    all_, cut = (
        SplatRasterizer(fuzzy, scene, least_light=light).draw(camera, pool).rgba
        for light in (0.0, 1 / 64)
    )
    assert all_[..., 3].max() > 1 - 1 / 64
    assert 0 < np.abs(all_ - cut).max() <= 1.5 / 64


def test_pictures_of_too_many_pixels_are_refused(pool: ThreadPool) -> None:
    drawer = SplatRasterizer(*blob())
    with pytest.raises(ValueError, match="may have"):
        drawer.draw(above(slab(), size=9000), pool)


@pytest.mark.parametrize("thin_mm", [0.02, *slow(0.5, 1e-4)])
@pytest.mark.parametrize("roll", [0.0, 0.3, 0.9, 1.5])
def test_squares_left_out_are_those_that_needles_miss(
    pool: ThreadPool, thin_mm: float, roll: float
) -> None:
    """Flat voxels on edge, hundreds of pixels long and a few wide, at any slant."""
    rng = np.random.default_rng(5)
    values = rng.uniform(60, 120, (4, 4, 5)).astype(np.float32)
    spacing = np.array([1.0, 0.9, thin_mm])
    volume = Volume(values, spacing, -spacing * [2.0, 1.5, 1.5])
    transfer = TransferFunction(
        np.array([0.0, 200.0]), np.ones((2, 3)), np.array([0.0, 0.5])
    )
    scene = Scene(volume, transfer)
    fuzzy = extract_fuzzy_set(volume, Inclusion.density(0, 120), 50.0)
    camera = Camera.looking_at(
        (1.0, -20.0, 0.01),
        (0, 0, 0),
        up=(np.sin(roll), 0.0, np.cos(roll)),
        extent=2.5,
        size=(230, 190),
        projection=Projection.ORTHOGRAPHIC,
    )
    image = SplatRasterizer(fuzzy, scene, least_light=0.0).draw(camera, pool).rgba
    plain = orthographic_picture(fuzzy, scene, camera)
    assert plain[..., 3].max() > 0
    # Footprints are a fit and normals are packed: .004 at most was measured. A square
    # left out by mistake lacks a tenth and more.
    np.testing.assert_allclose(image, plain, atol=6e-3)
