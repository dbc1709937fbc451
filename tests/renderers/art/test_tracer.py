import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from renderers.art import ActiveRayTracer, Quality, RenderStoppedError, render_among
from renderers.art.tracer import FASTER, RAYS_A_SLICE, SLICE_S, next_blocks, next_slice
from renderers.reference import render_reference
from renderers.scene import (
    AirSurface,
    Camera,
    Light,
    PhongMaterial,
    Projection,
    Renderer,
    Scene,
    TransferFunction,
    Volume,
    image_error,
)
from tests import boards
from tests.boards import KAPPA, METAL, SIZE, board

EXACT = Quality(0.5, 0.0)


def slab(kappa: float, thickness_mm: float = 20.0) -> Scene:
    """Make a uniform slab across y, wide enough that its sides are not seen."""
    volume = Volume(
        np.zeros((3, 9, 3), np.int16),
        np.array([200.0, thickness_mm / 8, 200.0]),
        np.array([-200.0, 0, -200]),
    )
    transfer = TransferFunction(
        np.array([-1.0, 1.0]), np.full((2, 3), 0.5), np.full(2, kappa)
    )
    return Scene(volume, transfer)


def looking_along_y(size: int = 9, extent: float = math.radians(35)) -> Camera:
    return Camera.looking_at(
        [0, -10, 0],
        [0, 10, 0],
        extent=extent,
        size=(size, size),
        projection=Projection.PERSPECTIVE,
    )


def hollow(radius_mm: float = 12.0, h: float = 0.5) -> Scene:
    """Make tissue around a ball of air at the origin."""
    n = 65
    axis = (np.arange(n) - (n - 1) / 2) * h
    r = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    distance = Volume(
        (r - radius_mm).astype(np.float32),
        np.full(3, h),
        np.full(3, axis[0]),
        background=1,
    )
    tint = distance.with_values(np.zeros(r.shape, np.uint8), 0)
    nothing = TransferFunction(np.array([0.0, 1.0]), np.zeros((2, 3)), np.zeros(2))
    return Scene(distance, nothing, surface=AirSurface(distance, tint, tint))


def test_it_is_a_renderer(scene: Scene) -> None:
    renderer: Renderer = ActiveRayTracer(scene)
    assert callable(renderer.render)


def test_a_slab_follows_its_closed_form_at_every_angle() -> None:
    camera = looking_along_y()
    rgba = ActiveRayTracer(slab(0.05), EXACT).render(camera).rgba
    cosine = camera.lens_table()[..., 2].astype(np.float64)
    alpha = -np.expm1(-0.05 * 20 / cosine)
    assert np.abs(rgba[..., 3] - alpha).max() < 1e-6
    assert np.abs(rgba[..., :3] - 0.5 * alpha[..., None]).max() < 1e-6
    assert alpha.max() - alpha.min() > 0.1


@settings(max_examples=15)
@given(
    step=st.floats(0.05, 4), kappa=st.floats(-12, 0.3).map(lambda digits: 10**digits)
)
def test_a_homogeneous_medium_does_not_depend_on_the_step(
    step: float, kappa: float
) -> None:
    """However thin it is and however many steps are made: six digits of opacity."""
    tracer = ActiveRayTracer(slab(kappa), Quality(step, 0.0))
    rgba = tracer.render(looking_along_y(2, 1e-4)).rgba
    exact = -math.expm1(-20 * kappa)
    assert rgba[..., 3] == pytest.approx(exact, rel=1e-6)
    assert rgba[..., 1] == pytest.approx(0.5 * exact, rel=1e-6)


def test_an_empty_scene_costs_nothing_and_shows_nothing() -> None:
    tracer = ActiveRayTracer(slab(0.0), EXACT)
    image = tracer.render(looking_along_y())
    assert not image.rgba.any()
    assert image.depth_mm is not None
    assert np.isinf(image.depth_mm).all()
    assert tracer.report is not None
    assert tracer.report.counters["samples"] == 0
    assert tracer.report.counters["cells_fetched"] == 0


@pytest.mark.parametrize("shift_mm", [0.0, 1e6])
def test_it_agrees_with_the_reference(scene: Scene, shift_mm: float) -> None:
    """Oblique axes and anisotropic voxels, at the origin and a kilometre away."""
    volume = scene.volume
    moved = Scene(
        Volume(
            volume.values,
            volume.spacing_mm,
            volume.origin_mm + shift_mm,
            volume.direction,
        ),
        scene.transfer_function,
        scene.lights[:4],
        scene.material,
    )
    centre = moved.volume.center_mm
    camera = Camera.looking_at(
        centre + np.array([22.0, -17, 9]), centre, extent=0.5, size=(24, 20)
    )
    image = ActiveRayTracer(moved, EXACT).render(camera)
    reference = render_reference(moved, camera, 0.5 * 0.4)
    error = image_error(image.rgba, reference)
    assert error.max < (2e-6 if shift_mm == 0 else 2e-5)
    assert reference[..., 3].max() > 0.9


COLOURED = (
    Light(np.array([0.3, -1.0, 0.4]), np.array([0.9, 0.2, 0.4])),
    Light(np.array([3.0, 2, 30]), np.array([0.1, 0.6, 0.3]), True),
)


@pytest.mark.parametrize("lights", [None, COLOURED[:1], COLOURED[1:], COLOURED])
def test_local_lights_and_highlights_agree_with_the_reference(
    scene: Scene, outside: Camera, lights: tuple[Light, ...] | None
) -> None:
    """Grey lights, of one channel for three, and coloured ones."""
    scene = scene if lights is None else replace(scene, lights=lights)
    image = ActiveRayTracer(scene, EXACT).render(outside)
    reference = render_reference(scene, outside, 0.5 * 0.4)
    error = image_error(image.rgba, reference)
    # Extinction jumps within .01 HU: a float32 density may fall beside the jump.
    assert error.rmse < 1e-6
    assert error.max < 5e-5


def test_halving_the_step_converges_at_second_order(scene: Scene) -> None:
    smooth = Scene(
        Volume(
            scene.volume.values.astype(np.float32),
            scene.volume.spacing_mm,
            scene.volume.origin_mm,
        ),
        TransferFunction(
            np.array([-900.0, 900.0]),
            np.array([[0.1, 0.5, 0.9], [0.9, 0.4, 0.1]]),
            np.array([0.0, 0.3]),
        ),
        material=PhongMaterial(1, 0, 0),
        lights=(),
    )
    centre = smooth.volume.center_mm
    camera = Camera.looking_at(
        centre + np.array([31.0, 12, 3]), centre, extent=0.3, size=(12, 12)
    )
    truth = render_reference(smooth, camera, 0.4 / 40, shaded=False)
    error = [
        image_error(
            ActiveRayTracer(smooth, Quality(step, 0.0)).render(camera).rgba, truth
        ).rmse
        for step in (4.0, 2.0, 1.0, 0.5)
    ]
    # Trilinear kinks keep single steps from the exact slope; the whole run has it.
    assert np.log2(error[0] / error[-1]) / 3 == pytest.approx(2, abs=0.3)


def test_cells_stay_for_the_next_picture(scene: Scene, outside: Camera) -> None:
    tracer = ActiveRayTracer(scene)
    first = tracer.render(outside)
    assert tracer.report is not None
    assert tracer.report.counters["cells_fetched"] > 0
    second = tracer.render(outside)
    assert tracer.report.counters["cells_fetched"] == 0
    assert first.rgba.tobytes() == second.rgba.tobytes()


@settings(max_examples=8)
@given(
    x=st.floats(-5, 5), y=st.floats(-5, 5), z=st.floats(-5, 5), step=st.floats(0.25, 1)
)
def test_a_ball_of_air_has_its_depth_and_normals(
    x: float, y: float, z: float, step: float
) -> None:
    radius, h = 12.0, 0.5
    camera = Camera.looking_at([x, y, z], [x + 1, y + 2, z - 0.5], size=(16, 16))
    found = ActiveRayTracer(hollow(radius, h), Quality(step, 0.0)).gbuffer(camera)
    origins, directions = camera.rays()
    seen = np.linalg.norm(directions, axis=-1) > 0.5
    along = np.sum(origins * directions, axis=-1)
    exact = -along + np.sqrt(along**2 - np.sum(origins**2, axis=-1) + radius**2)
    assert np.array_equal(np.isfinite(found.depth_mm), seen)
    # The chord of a trilinear ball: h^2 / 4R where it is cut straight.
    slant = 1 / np.cos(np.arcsin(np.linalg.norm([x, y, z]) / radius))
    assert np.abs(found.depth_mm - exact)[seen].max() < 1.2 * h**2 / 4 / radius * slant
    points = origins + exact[..., None] * directions
    cosine = np.sum(-points / radius * found.normal, axis=-1)[seen]
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 0.25
    assert np.array_equal(found.coverage, seen.astype(np.float32))
    assert not found.material.any()


def test_depth_converges_with_the_grid_at_second_order() -> None:
    camera = Camera.looking_at([1, 2, 0.5], [5, 4, 1], extent=0.3, size=(16, 16))
    origins, directions = camera.rays()
    along = np.sum(origins * directions, axis=-1)
    exact = -along + np.sqrt(along**2 - np.sum(origins**2, axis=-1) + 36)
    seen = np.linalg.norm(directions, axis=-1) > 0.5
    error = []
    for h in (0.9, 0.45, 0.225):
        depth = ActiveRayTracer(hollow(6.0, h), EXACT).gbuffer(camera).depth_mm
        error.append(np.sqrt(np.mean((depth - exact)[seen] ** 2)))
    order = np.log2(np.array(error[:-1]) / error[1:])
    assert order.mean() == pytest.approx(2, abs=0.3)


def test_an_eye_in_tissue_sees_it_at_once() -> None:
    camera = Camera.looking_at([0, -14.5, 0], [0, 0, 0], size=(8, 8))
    found = ActiveRayTracer(hollow()).gbuffer(camera)
    seen = found.coverage > 0
    assert seen.any()
    assert not found.depth_mm[seen].any()


def test_row_0_is_at_the_top_and_left_is_left() -> None:
    """An opaque block at high z, high x, seen along +y with z up."""
    values = np.zeros((17, 17, 17), np.int16)
    values[12:, :, 12:] = 1000
    volume = Volume(values, np.ones(3), np.full(3, -8.0))
    transfer = TransferFunction(
        np.array([400.0, 600]), np.ones((2, 3)), np.array([0.0, 5.0])
    )
    alpha = (
        ActiveRayTracer(Scene(volume, transfer))
        .render(
            Camera.looking_at(
                [0, -30, 0],
                [0, 0, 0],
                extent=8,
                size=(16, 16),
                projection=Projection.ORTHOGRAPHIC,
            )
        )
        .rgba[..., 3]
    )
    assert alpha[2, 13] > 0.99
    assert alpha[2, 2] == alpha[13, 2] == alpha[13, 13] == 0


def test_depth_of_classic_is_where_it_becomes_opaque() -> None:
    image = ActiveRayTracer(slab(2.0), Quality(0.05, 0.0)).render(
        looking_along_y(2, 1e-4)
    )
    assert image.depth_mm is not None
    assert image.depth_mm == pytest.approx(10 + math.log(2) / 2, abs=0.13)


def test_a_picture_can_be_given_up_and_begun_again(
    scene: Scene, outside: Camera
) -> None:
    tracer = ActiveRayTracer(scene, validate=True)
    expected = ActiveRayTracer(scene).render(outside).rgba.tobytes()

    def stop_at(share: float) -> Callable[[float], bool]:
        return lambda done: done < share

    for share in (0.0, 0.4):
        with pytest.raises(RenderStoppedError):
            tracer.render(outside, stop_at(share))
    assert tracer.render(outside).rgba.tobytes() == expected


def test_caller_mistakes_are_named(scene: Scene, outside: Camera) -> None:
    with pytest.raises(ValueError, match="no quality is called 'best'"):
        ActiveRayTracer(scene, "best")
    with pytest.raises(ValueError, match="threads must be at least 1"):
        ActiveRayTracer(scene, threads=0)
    for side in (9, 0):
        with pytest.raises(ValueError, match="cell side must be one of"):
            ActiveRayTracer(scene, cell_side=side).render(outside)
    with pytest.raises(ValueError, match="no air surface"):
        ActiveRayTracer(slab(1.0)).gbuffer(outside)
    values = np.zeros((4, 4, 4), np.float32)
    values[1, 2, 3] = np.nan
    broken = Scene(Volume(values, np.ones(3), np.zeros(3)), scene.transfer_function)
    with pytest.raises(ValueError, match="not finite"):
        ActiveRayTracer(broken).render(outside)


@pytest.fixture(scope="module")
def slab_tracer() -> ActiveRayTracer:
    """A slab of 20 mm with its near face 30 mm before the eye."""
    return ActiveRayTracer(boards.slab(21, 30.0), "final", threads=1)


@pytest.mark.parametrize("depth_mm", [10.0, 34.0, 40.0, 46.0])
def test_a_board_in_a_slab_is_seen_through_what_is_before_it(
    slab_tracer: ActiveRayTracer, depth_mm: float
) -> None:
    image = render_among(slab_tracer, boards.camera(), board(depth_mm))
    right = slice(SIZE // 2, None)
    along = board(depth_mm).depth_mm[:, right].astype(np.float64)
    slant = boards.camera().lens_table()[:, right, 2]
    before_mm = np.maximum(along - 30.0 / slant, 0.0)
    absorbed = -np.expm1(-KAPPA * before_mm)[..., None]
    # without a gradient the plain colour is 0.5
    wanted = 0.5 * absorbed + (1 - absorbed) * METAL
    assert np.abs(image.rgba[:, right, :3] - wanted).max() < 2e-5
    assert np.allclose(image.rgba[:, right, 3], 1, atol=1e-6)
    whole = -np.expm1(-KAPPA * 20 / boards.camera().lens_table()[:, : SIZE // 2, 2])
    assert np.abs(image.rgba[:, : SIZE // 2, 3] - whole).max() < 2e-5
    assert image.depth_mm is not None
    assert np.all(image.depth_mm[:, right] <= along)


@given(
    st.integers(1, 32),
    st.lists(st.floats(0, 10, allow_nan=False), min_size=1, max_size=30),
    st.integers(256, 16384),
)
def test_a_slice_gives_each_thread_a_packet_and_no_more_than_it_may(
    threads: int, spent: list[float], rays: int
) -> None:
    packets = threads
    for seconds in spent:
        before = packets
        packets = next_slice(packets, seconds, threads, rays)
        assert threads <= packets <= max(RAYS_A_SLICE // rays, threads)
        if seconds > SLICE_S:
            assert packets <= max(before, threads)
    for _ in range(9):
        packets = next_slice(packets, 2 * SLICE_S, threads, rays)
    assert packets == threads


@given(st.integers(1, 32), st.floats(1e-6, 10), st.integers(1, 5000))
def test_blocks_come_to_fill_a_slice_however_long_one_takes(
    threads: int, block_s: float, blocks: int
) -> None:
    """And never grow by more than a factor that is known."""
    for _ in range(12):
        before = blocks
        blocks = next_blocks(before, before * block_s, threads)
        assert threads <= blocks <= max(FASTER * before, threads)
    assert blocks == threads or 0.9 * SLICE_S - block_s <= blocks * block_s
    assert blocks == threads or blocks * block_s <= 1.1 * SLICE_S


def test_where_steps_are_fine_packets_are_small(
    scene: Scene, outside: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A packet cannot be interrupted; as if each took too long, each is a slice."""
    monkeypatch.setattr("renderers.art.tracer.SLICE_S", -1.0)
    for step, packets in ((0.25, 1), (1 / 16, 4), (1 / 32, 16)):
        shares: list[float] = []
        tracer = ActiveRayTracer(scene, Quality(step, 0.0), threads=1)

        def note(share: float, shares: list[float] = shares) -> bool:
            shares.append(share)
            return True

        # parts of a strip that meet cells nobody had looked at yet go on later
        tracer.render(outside.with_size(64, 64))
        tracer.render(outside.with_size(64, 64), note)
        assert len(set(shares) - {0.0}) == packets
        assert shares == sorted(shares)
        assert shares[-1] == 1
