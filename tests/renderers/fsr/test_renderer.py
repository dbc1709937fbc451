import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from renderers.fsr import (
    FuzzySetRenderer,
    Inclusion,
    SplatMode,
    Traversal,
    render_among,
)
from renderers.scene import (
    AirSurface,
    Camera,
    Change,
    ChangeKind,
    Distortion,
    Renderer,
    Scene,
    TransferFunction,
    Volume,
)
from renderers.scene.deflection import Deflection, Translation
from surgery.edit import CuttingLimits
from surgery.patient import OperatedPatient
from surgery.solids import capsule
from tests.boards import KAPPA, METAL, SIZE, board, slab
from tests.boards import camera as board_camera

TRANSFER = TransferFunction(
    np.array([-1000.0, -700.0, -300.0, 400.0]),
    np.tile([1.0, 0.5, 0.4], (4, 1)),
    np.array([0.0, 0.0, 3.0, 3.0]),
)


def scene_of(distance: Volume, *, with_surface: bool = True) -> Scene:
    """Give tissue of 40 HU around the air, blurred over one voxel."""
    hu = 1040 * np.clip(0.5 + distance.values / 1.0, 0, 1) - 1000
    tint = distance.with_values(np.zeros(distance.shape, np.uint8), 0.0)
    return Scene(
        distance.with_values(hu.astype(np.int16), -1000.0),
        TRANSFER,
        surface=AirSurface(distance, tint, tint) if with_surface else None,
    )


def test_it_is_a_renderer_in_both_modes(hollow: Volume) -> None:
    renderer = FuzzySetRenderer(scene_of(hollow), threads=2)
    as_renderer: Renderer = renderer
    assert renderer.splat_count == 0
    camera = Camera.looking_at((0.5, -2, 0), (0, 4, 0), size=(80, 60))
    g = as_renderer.gbuffer(camera)
    assert g.size == (60, 80)
    seen = np.any(camera.lens_table() != 0, axis=-1)
    assert np.array_equal(g.coverage > 0, seen)
    assert renderer.splat_count > 0
    counters = renderer.counters
    assert counters["splats"] == renderer.splat_count
    assert 0 < counters["visible"] <= counters["listed"] <= counters["splats"]
    assert counters["fragments"] > 0
    assert 0 < counters["culled rows"] < counters["rows"]
    image = as_renderer.render(camera)
    assert image.size == (60, 80)
    # a disc of the field's radius; the picture's edge is not stopped in `classic`
    assert image.rgba[30, 40, 3] > 0.9
    assert renderer.counters["splats"] == len(renderer.fuzzy_set)
    renderer.close()


def test_the_default_set_is_the_wall_not_the_tissue_behind_it(hollow: Volume) -> None:
    fuzzy = FuzzySetRenderer(scene_of(hollow)).fuzzy_set
    radius = np.linalg.norm(fuzzy.rows.centers_mm(), axis=1)
    assert np.all(np.abs(radius - 6) < 1.6)
    inward = -(fuzzy.normals() * fuzzy.rows.centers_mm()).sum(1) / radius
    # at the rim of the soft edge the gradient is small and less sure
    assert inward.mean() > 0.99
    assert inward.min() > 0.85


def test_another_inclusion_and_points_are_taken(hollow: Volume) -> None:
    scene = scene_of(hollow)
    renderer = FuzzySetRenderer(
        scene,
        inclusion=Inclusion.density(-1000, 400),
        threshold=-100.0,
        mode=SplatMode.POINTS,
    )
    assert len(renderer.fuzzy_set) == np.sum(scene.volume.values >= -100)
    camera = Camera.looking_at((0.5, -2, 0), (0, 4, 0), size=(40, 40))
    assert renderer.render(camera).rgba[20, 20, 3] > 0.9


def test_without_an_air_surface_there_is_no_scope_mode(hollow: Volume) -> None:
    renderer = FuzzySetRenderer(scene_of(hollow, with_surface=False))
    with pytest.raises(ValueError, match="no air surface"):
        renderer.gbuffer(Camera.looking_at((0, 0, 0), (0, 1, 0)))


def test_threads_must_be_positive(hollow: Volume) -> None:
    with pytest.raises(ValueError, match="at least one thread"):
        FuzzySetRenderer(scene_of(hollow), threads=0)


def test_a_film_is_its_pictures_and_tells_what_each_took(hollow: Volume) -> None:
    renderer = FuzzySetRenderer(scene_of(hollow), threads=2)
    cameras = [
        Camera.looking_at((0.5, y, 0), (0, 4, 0), size=(50, 40)) for y in (-2, -1, 0)
    ]
    for camera, image in zip(cameras, renderer.film(cameras), strict=True):
        counters = renderer.counters
        assert counters["fragments"] > 0
        assert renderer.render(camera).rgba.tobytes() == image.rgba.tobytes()
        assert renderer.counters == counters
    renderer.close()


def test_a_threshold_set_anew_gives_the_set_of_a_new_renderer(hollow: Volume) -> None:
    scene = scene_of(hollow)
    slider = FuzzySetRenderer(scene)
    camera = Camera.looking_at((0.5, -2, 0), (0, 4, 0), size=(40, 40))
    counts = []
    for threshold in (0.1, 0.6, 0.3, 0.1):
        slider.threshold = threshold
        assert slider.threshold == threshold
        counts.append(len(slider.fuzzy_set))
        fresh = FuzzySetRenderer(scene, threshold=threshold)
        assert (
            slider.render(camera).rgba.tobytes() == fresh.render(camera).rgba.tobytes()
        )
    assert counts[0] == counts[3] > counts[2] > counts[1] > 0


def test_the_order_of_1995_is_taken_where_it_is_asked_for(hollow: Volume) -> None:
    """Nearly the same picture; a film has its bits."""
    scene = scene_of(hollow)
    by_grid = FuzzySetRenderer(scene, traversal=Traversal.GRID, threads=2)
    by_distance = FuzzySetRenderer(scene, threads=2)
    cameras = [
        Camera.looking_at((0.5, y, 0), (0, 4, 0), size=(60, 50)) for y in (-2, -60)
    ]
    for camera, shown in zip(cameras, by_grid.film(cameras), strict=True):
        a, b = by_grid.render(camera), by_distance.render(camera)
        assert a.rgba.tobytes() == shown.rgba.tobytes()
        assert a.rgba[..., 3].max() > 0.5
        assert np.abs(a.rgba - b.rgba).max() > 1e-6
        assert np.abs(a.rgba - b.rgba).mean() < 0.01
    by_grid.close()
    by_distance.close()


def test_modes_may_be_named_and_others_are_refused(hollow: Volume) -> None:
    name: Any = "points"
    renderer = FuzzySetRenderer(scene_of(hollow), mode=name, threads=1)
    assert renderer.mode is SplatMode.POINTS
    wrong: Any = "point"
    with pytest.raises(ValueError, match="'gaussian' or 'points', got 'point'"):
        FuzzySetRenderer(scene_of(hollow), mode=wrong, threads=1)
    gone: Any = "sheet"
    with pytest.raises(ValueError, match="'sheet' is no more: take 'gaussian'"):
        FuzzySetRenderer(scene_of(hollow), mode=gone, threads=1)


def test_a_distorted_lens_is_refused_by_name(hollow: Volume) -> None:
    renderer = FuzzySetRenderer(scene_of(hollow), threads=1)
    camera = Camera.looking_at(
        (0.5, -2, 0), (0, 4, 0), size=(16, 16), distortion=Distortion(-0.1, 0.02)
    )
    for draw in (renderer.render, renderer.gbuffer):
        with pytest.raises(ValueError, match=r"without distortion, got .*k1=-0\.1"):
            draw(camera)
    with pytest.raises(ValueError, match="take the ray tracer for this lens"):
        list(renderer.film([camera]))
    renderer.close()


@pytest.fixture(scope="module")
def slab_renderer() -> Iterator[FuzzySetRenderer]:
    """A slab of 20 mm with its near face 30 mm before the eye."""
    scene = slab(20, 30.5)
    made = FuzzySetRenderer(
        scene, inclusion=Inclusion.opacity(scene.transfer_function, 1.0), threshold=0.0
    )
    yield made
    made.close()


@pytest.mark.parametrize("depth_mm", [10.0, 34.0, 40.0, 46.0])
def test_a_board_in_a_slab_is_seen_through_what_is_before_it(
    slab_renderer: FuzzySetRenderer, depth_mm: float
) -> None:
    image = render_among(slab_renderer, board_camera(), board(depth_mm))
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


def test_after_an_edit_both_modes_show_what_a_new_renderer_shows(
    hollow: Volume,
) -> None:
    scene = scene_of(hollow)
    distance, hu = hollow.values.copy(), scene.volume.values.copy()
    assert scene.surface is not None
    surface = replace(
        scene.surface, distance=hollow.with_values(distance, hollow.background)
    )
    edited = replace(
        scene, volume=scene.volume.with_values(hu, -1000.0), surface=surface
    )
    live = FuzzySetRenderer(edited, threads=1)
    camera = Camera.looking_at((0.5, -2, 0), (0, 4, 0), size=(80, 60))
    first = live.gbuffer(camera), live.render(camera)
    k, j, i = np.indices(distance.shape) * 0.5 - 8.0
    ball = np.sqrt(i**2 + (j - 5.5) ** 2 + (k - 1) ** 2) - 2.0
    changed = np.argwhere(ball < distance)[:, ::-1]
    low, high = changed.min(axis=0), changed.max(axis=0)
    for carved, kind in ((np.minimum(distance, ball), "cut"), (hollow.values, "undo")):
        distance[...] = carved
        hu[...] = 1040 * np.clip(0.5 + distance, 0, 1) - 1000
        live.update(Change(1, low, high))
        live.update(Change(2, low, high, ChangeKind.FILM))
        fresh = FuzzySetRenderer(edited, threads=2)
        a, b = live.gbuffer(camera), fresh.gbuffer(camera)
        assert np.array_equal(a.depth_mm, b.depth_mm)
        assert np.array_equal(a.normal, b.normal)
        assert np.array_equal(live.render(camera).rgba, fresh.render(camera).rgba)
        is_first = np.array_equal(live.render(camera).rgba, first[1].rgba)
        assert is_first == np.array_equal(a.depth_mm, first[0].depth_mm)
        assert is_first == (kind == "undo")


def test_creases_of_cuts_follow_edits(hollow: Volume) -> None:
    scene = scene_of(hollow)
    assert scene.surface is not None
    patient = OperatedPatient(scene.surface, None)
    operated = replace(scene, surface=patient.surface)
    live = FuzzySetRenderer(operated, threads=1)
    camera = Camera.looking_at((0.5, -2, 0), (0, 4, 0), size=(96, 96))
    live.gbuffer(camera)
    assert live.counters.get("crease pixels", 0) == 0
    settled = 0
    for z in (-1.5, 0.0, 1.5):
        edit = patient.carve(capsule((0, 6, z), (0, 7, z), 1.2), CuttingLimits())
        assert edit is not None
        live.update(edit.change)
        found = live.gbuffer(camera)
        settled += live.counters["crease pixels"]
        wanted = FuzzySetRenderer(operated, threads=3).gbuffer(camera)
        assert np.array_equal(found.depth_mm, wanted.depth_mm)
        assert np.array_equal(found.normal, wanted.normal)
    assert settled > 0


def test_a_renderer_with_a_deflection_refuses_edits(hollow: Volume) -> None:
    push = Deflection((Translation(np.array([6.0, 0, 0]), 3.0, np.array([0.5, 0, 0])),))
    renderer = FuzzySetRenderer(scene_of(hollow), deflection=push)
    with pytest.raises(ValueError, match="make a new one"):
        renderer.update(Change(1, np.zeros(3, np.int64), np.zeros(3, np.int64)))
