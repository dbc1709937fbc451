import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from renderers.fsr import FuzzySet, Inclusion, extract_fuzzy_set
from renderers.fsr.splats import SplatMode, SplatRasterizer
from renderers.scene import (
    Camera,
    Light,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)
from renderers.scene.thread_team import ThreadTeam
from tests.renderers.fsr.plain_splats import orthographic_picture
from tests.slow_cases import slow

Splats = tuple[FuzzySet, Scene]


@pytest.mark.parametrize("kappa", [0.02, 0.2, 1.0])
@pytest.mark.parametrize("spacing", [(1, 1, 1), (1, 1, 2.5), (1.4, 1, 1)])
def test_a_uniform_slab_has_the_right_mean_opacity_and_little_ripple(
    team: ThreadTeam,
    kappa: float,
    spacing: tuple[float, float, float],
    slab: Callable[..., Volume],
    above: Callable[..., Camera],
    unlit: Callable[..., Splats],
) -> None:
    volume = slab(spacing=spacing)
    image = SplatRasterizer(*unlit(volume, kappa)).draw(above(volume), team)
    truth = -math.expm1(-kappa * 6 * spacing[2])
    alpha = image.rgba[..., 3]
    assert alpha.mean() == pytest.approx(truth, rel=0.02)
    assert np.ptp(alpha) * 255 <= 6
    # unlit, so the colour is the classified one
    np.testing.assert_allclose(
        image.rgba[..., :3], alpha[..., None] * [0.8, 0.6, 0.4], atol=1e-5
    )


@pytest.mark.parametrize("kappa", [0.05, 0.5])
def test_point_splats_have_the_right_mean(
    team: ThreadTeam,
    kappa: float,
    slab: Callable[..., Volume],
    above: Callable[..., Camera],
    unlit: Callable[..., Splats],
) -> None:
    volume = slab()
    drawer = SplatRasterizer(*unlit(volume, kappa))
    image = drawer.draw(above(volume, 7.3), team, SplatMode.POINTS)
    assert image.rgba[..., 3].mean() == pytest.approx(-math.expm1(-kappa * 6), rel=0.05)


def test_small_splats_keep_their_optical_depth(
    team: ThreadTeam, above: Callable[..., Camera], unlit: Callable[..., Splats]
) -> None:
    """One voxel seen at any size has the same integral of optical depth."""
    values = np.zeros((5, 5, 5), np.float32)
    values[2, 2, 2] = 100
    volume = Volume(values, np.ones(3), np.zeros(3))
    drawer = SplatRasterizer(*unlit(volume, 1e-3))
    for size in (4, 16, 160):
        alpha = drawer.draw(above(volume, 8.0, size), team).rgba[..., 3]
        total = -np.log1p(-alpha).sum() * (16 / size) ** 2
        assert total == pytest.approx(1e-3, rel=0.06)


def test_an_empty_set_gives_a_transparent_picture(
    team: ThreadTeam,
    slab: Callable[..., Volume],
    above: Callable[..., Camera],
    of_one_kappa: Callable[[float], TransferFunction],
) -> None:
    volume = slab()
    scene = Scene(volume, of_one_kappa(1.0))
    empty = extract_fuzzy_set(volume, Inclusion.density(0, 200), 150.0)
    drawer = SplatRasterizer(empty, scene)
    assert not drawer.draw(above(volume), team).rgba.any()
    assert drawer.counters["visible"] == 0


@pytest.mark.parametrize("eye", [(5, -9, 6), (5.2, 1.1, 4.3), (2, 5, 9)])
def test_bits_do_not_depend_on_the_number_of_threads(
    team: ThreadTeam,
    three: ThreadTeam,
    blob: Callable[..., Splats],
    eye: tuple[float, float, float],
) -> None:
    """From outside, and among splats that are near and wide."""
    drawer = SplatRasterizer(*blob())
    for projection, extent in zip(Projection, (0.7, 0.7, 6.0), strict=True):
        camera = Camera.looking_at(
            eye, (5, 5, 4), extent=extent, size=(90, 130), projection=projection
        )
        for mode in SplatMode:
            one = drawer.draw(camera, team, mode, with_depth=True)
            many = drawer.draw(camera, three, mode, with_depth=True)
            assert one.rgba.tobytes() == many.rgba.tobytes()
            assert one.depth_mm is not None
            assert many.depth_mm is not None
            assert one.depth_mm.tobytes() == many.depth_mm.tobytes()


def test_grid_order_gives_the_picture_of_sorting_by_depth(
    team: ThreadTeam, blob: Callable[..., Splats]
) -> None:
    """Along an axis the orders differ only among the splats of one slice."""
    fuzzy, scene = blob(3)
    camera = Camera.looking_at(
        (5, 5, -30),
        (5, 5, 5),
        up=(0, 1, 0),
        extent=7.0,
        size=(48, 40),
        projection=Projection.ORTHOGRAPHIC,
    )
    image = SplatRasterizer(fuzzy, scene).draw(camera, team)
    difference = np.abs(image.rgba - orthographic_picture(fuzzy, scene, camera))
    assert difference.max() < 0.03
    assert difference.mean() < 1e-3


def test_an_eye_among_the_splats_sees_a_finite_picture(
    team: ThreadTeam, blob: Callable[..., Splats]
) -> None:
    drawer = SplatRasterizer(*blob())
    for projection in (Projection.EQUIDISTANT, Projection.PERSPECTIVE):
        camera = Camera.looking_at(
            (5.1, 5.0, 4.0), (6, 9, 5), size=(64, 64), projection=projection
        )
        rgba = drawer.draw(camera, team).rgba
        assert np.all(np.isfinite(rgba))
        assert rgba[..., 3].max() <= 1 + 1e-6
        assert rgba[..., 3].min() >= 0


def test_a_local_light_far_away_equals_an_infinite_one(
    team: ThreadTeam, blob: Callable[..., Splats]
) -> None:
    fuzzy, scene = blob()
    direction = np.array([0.48, 0.6, 0.64])
    color = np.array([0.9, 0.7, 0.5])
    camera = Camera.looking_at((5, -12, 9), (5, 5, 4), size=(48, 48))
    pictures = [
        SplatRasterizer(
            fuzzy, Scene(scene.volume, scene.transfer_function, (light,))
        ).draw(camera, team)
        for light in (
            Light(direction, color),
            Light(1e6 * direction, color, is_local=True),
        )
    ]
    np.testing.assert_allclose(pictures[0].rgba, pictures[1].rgba, atol=1e-4)


@pytest.mark.parametrize("projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE])
def test_a_wall_third_of_a_millimetre_ahead_is_opaque(
    team: ThreadTeam,
    projection: Projection,
    unlit: Callable[..., Splats],
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
    image = drawer.draw(camera, team, with_depth=True)
    assert drawer.counters["subdivided"] > 0
    assert np.all(np.isfinite(image.rgba))
    assert image.rgba[..., 3].min() >= 0.99
    assert image.depth_mm is not None
    assert 0.1 < image.depth_mm[48, 48] < 0.8


def test_leaving_out_what_has_no_light_changes_less_than_that_light(
    team: ThreadTeam, blob: Callable[..., Splats]
) -> None:
    fuzzy, scene = blob()
    camera = Camera.looking_at((5, -12, 6), (5, 5, 4), extent=0.4, size=(90, 90))
    all_, cut = (
        SplatRasterizer(fuzzy, scene, least_light=light).draw(camera, team).rgba
        for light in (0.0, 1 / 64)
    )
    assert all_[..., 3].max() > 1 - 1 / 64
    assert 0 < np.abs(all_ - cut).max() <= 1.5 / 64


def test_sixty_five_thousand_splats_on_one_pixel(
    team: ThreadTeam, unlit: Callable[..., Splats]
) -> None:
    """A column of voxels seen along itself from far away."""
    volume = Volume(np.full((256, 16, 16), 100, np.float32), np.ones(3), np.zeros(3))
    _, scene = unlit(volume, 0.05)  # 1e-5 of opacity at the pixel
    fuzzy = extract_fuzzy_set(volume, Inclusion.density(0, 200), 50.0)
    camera = Camera.looking_at(
        (7.5, 7.5, 4e4),
        (7.5, 7.5, 0),
        up=(0, 1, 0),
        extent=40.0,
        size=(1, 1),
        projection=Projection.ORTHOGRAPHIC,
    )
    assert len(fuzzy) == 65536
    drawer = SplatRasterizer(fuzzy, scene, least_light=0.0)
    alpha = drawer.draw(camera, team).rgba[0, 0, 3]
    assert drawer.counters["visible"] == 65536
    # all mass in a pixel of 80 mm, softened; at its centre within the footprint
    assert 0 < alpha < 1
    total = 65536 * 0.05 / 80**2
    peak = 1 / (2 * math.pi * 0.3)
    assert -math.log1p(-alpha) == pytest.approx(total * peak, rel=0.1)


@pytest.mark.parametrize("mode", SplatMode)
def test_splats_behind_or_off_the_picture_leave_no_trace(
    team: ThreadTeam, mode: SplatMode, blob: Callable[..., Splats]
) -> None:
    drawer = SplatRasterizer(*blob())
    for eye, target in (((5, 40, 4), (5, 90, 4)), ((5, 40, 4), (90, 40, 4))):
        camera = Camera.looking_at(
            eye, target, extent=0.4, size=(50, 40), projection=Projection.PERSPECTIVE
        )
        assert not drawer.draw(camera, team, mode).rgba.any()
        assert drawer.counters["visible"] == 0


def test_pictures_of_too_many_pixels_are_refused(
    team: ThreadTeam,
    slab: Callable[..., Volume],
    above: Callable[..., Camera],
    blob: Callable[..., Splats],
) -> None:
    drawer = SplatRasterizer(*blob())
    with pytest.raises(ValueError, match="may have"):
        drawer.draw(above(slab(), size=9000), team)


@pytest.mark.parametrize("thin_mm", [0.02, *slow(0.5, 1e-4)])
@pytest.mark.parametrize("roll", [0.0, 0.3, 0.9, 1.5])
def test_squares_left_out_are_those_that_needles_miss(
    team: ThreadTeam, thin_mm: float, roll: float
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
    image = SplatRasterizer(fuzzy, scene, least_light=0.0).draw(camera, team).rgba
    plain = orthographic_picture(fuzzy, scene, camera)
    assert plain[..., 3].max() > 0
    # Footprints are a fit and normals are packed: .004 at most was measured. A square
    # left out by mistake lacks a tenth and more.
    np.testing.assert_allclose(image, plain, atol=6e-3)


def path() -> list[tuple[Camera, SplatMode]]:
    """Give views around a set, from outside and among the splats, in all modes."""
    modes = list(SplatMode)
    return [
        (
            Camera.looking_at(
                (5 + radius * np.sin(turn), 5 - radius * np.cos(turn), 5.5),
                (5, 5, 4.5),
                extent=0.6,
                size=(75, 66),
                projection=Projection.PERSPECTIVE,
            ),
            modes[turn % 2],
        )
        for turn in range(6)
        for radius in (3.0, 14.0)
    ]


def test_a_film_has_the_bits_of_single_pictures(
    three: ThreadTeam, blob: Callable[..., Splats]
) -> None:
    drawer, other = SplatRasterizer(*blob()), SplatRasterizer(*blob())
    pictures = list(drawer.film(path(), three))
    assert len(pictures) == len(path())
    for (camera, mode), picture in zip(path(), pictures, strict=True):
        single = other.draw(camera, three, mode)
        assert single.rgba[..., 3].max() > 0
        assert picture.rgba.tobytes() == single.rgba.tobytes()


def test_the_next_view_is_taken_before_a_picture_is_given(
    team: ThreadTeam, blob: Callable[..., Splats]
) -> None:
    taken = []

    def watched() -> Iterator[tuple[Camera, SplatMode]]:
        for number, view in enumerate(path()):
            taken.append(number)
            yield view

    pictures = SplatRasterizer(*blob()).film(watched(), team)
    for number, _ in enumerate(pictures):
        assert taken[-1] == min(number + 1, len(path()) - 1)


def test_no_views_give_no_pictures(
    team: ThreadTeam, blob: Callable[..., Splats]
) -> None:
    assert list(SplatRasterizer(*blob()).film([], team)) == []
