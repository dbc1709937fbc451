"""What steps are foretold to leave out, against what they do."""

import itertools
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.art.ranks.prepare import make_node
from renderers.art.step_estimation import StepErrors, StepEstimate
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
    image_error,
)

AIMED = Quality(1.0, 0.0, classification="integrated", tolerance=4e-3)


def smooth(seed: int, shape: tuple[int, int, int] = (22, 24, 20)) -> NDArray[np.int16]:
    """Give waves of a few voxels, -1000 to 1000."""
    rng = np.random.default_rng(seed)
    z, y, x = np.indices(shape)
    total = np.zeros(shape)
    for _ in range(6):
        kx, ky, kz = rng.uniform(0.3, 0.9, 3)
        total += np.sin(kx * x + ky * y + kz * z + rng.uniform(0, 6))
    waves: NDArray[np.int16] = np.rint(1000 * total / np.abs(total).max()).astype("i2")
    return waves


def see_through(steepness: float) -> TransferFunction:
    """Show what is dense through what is less so."""
    return TransferFunction(
        np.array([0.0, 100, 200, 1000]),
        np.array([[0.6, 0.3, 0.2], [0.8, 0.6, 0.5], [0.9, 0.9, 0.8], [0.9, 0.9, 0.8]]),
        steepness * np.array([0.0, 0.1, 1.0, 2.0]),
    )


def scene_of(values: NDArray[np.generic], transfer: TransferFunction) -> Scene:
    volume = Volume(values, np.array([1.0, 0.9, 1.1]), np.array([3.0, -4, 5]))
    return Scene(volume, transfer, (), PhongMaterial(1, 0, 0))


def aside_of(scene: Scene) -> Camera:
    """Look at a scene's middle from beside it."""
    center = scene.volume.center_mm
    return Camera.looking_at(
        center + np.array([30.0, -25, 12]), center, extent=0.3, size=(64, 64),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip


def picture_of(scene: Scene, camera: Camera, step: float) -> NDArray[np.float32]:
    """Draw a scene in integrated steps of so many voxels."""
    quality = Quality(step, 0.0, classification="integrated")
    return ActiveRayTracer(scene, quality).render(camera).rgba


def test_the_error_of_a_picture_is_foretold() -> None:
    """Within a factor of 1.6: a picture sees some of the lines' ways, not all.

    An eighth lies two halvings beyond what is measured, a quarter beside it.
    """
    scene = scene_of(smooth(1), see_through(2.0))
    errors = StepErrors.of(scene)
    camera = aside_of(scene)
    picture = partial(picture_of, scene, camera)
    truth = picture(1 / 32)
    shown = truth[..., 3] > 0
    for step, factor in ((1.0, 1.6), (0.5, 1.6), (0.25, 1.6), (0.125, 2.0)):
        error = image_error(picture(step)[shown], truth[shown]).rmse
        assert error / factor < errors.error(step) < error * factor
    aimed = ActiveRayTracer(scene, AIMED)
    found = aimed.render(camera).rgba
    assert image_error(found[shown], truth[shown]).rmse < 1.6 * 4e-3
    assert aimed.report is not None
    assert 0.25 < aimed.report.step_voxels < 1
    # the very picture of that step
    assert np.array_equal(found, picture(aimed.report.step_voxels))


def test_a_shell_far_thinner_than_a_voxel_is_errors_by_finer_lines() -> None:
    """What is left falls too slowly to be foretold from steps of a voxel and a half.

    To a factor of two: the few lines that graze the shell tell the most.
    """
    shell = TransferFunction(
        np.array([-15.0, 0, 15]), np.ones((3, 3)), np.array([0, 12.0, 0])
    )
    scene = scene_of(smooth(2), shell)
    camera = aside_of(scene)
    picture = partial(picture_of, scene, camera)
    errors = StepErrors.of(scene, 2e-3)
    assert len(errors.finer) >= 2
    assert StepErrors.of(scene).finer == ()
    truth = picture(1 / 128)
    shown = truth[..., 3] > 0
    for step in (1 / 4, 1 / 8, 1 / 16):
        error = image_error(picture(step)[shown], truth[shown]).rmse
        assert error / 2 < errors.error(step) < error * 2
    quality = StepEstimate(scene, replace(AIMED, tolerance=2e-3)).quality
    assert quality.step_voxels < 1 / 4
    assert image_error(picture(quality.step_voxels)[shown], truth[shown]).rmse < 4e-3


def test_what_segments_integrate_exactly_keeps_its_step() -> None:
    """A ramp of density, a line through the transfer function (scene S5)."""
    ramp = np.zeros((12, 10, 9), np.float32) + np.arange(12)[:, None, None]
    line = TransferFunction(
        np.array([-20.0, 50]), np.ones((2, 3)), np.array([0.1, 0.6])
    )
    scene = scene_of(ramp, line)
    errors = StepErrors.of(scene)
    assert errors.whole < 2e-6
    assert StepEstimate(scene, AIMED).quality == replace(AIMED, tolerance=None)


def test_nothing_to_see_needs_no_shorter_steps() -> None:
    clear = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.zeros(2))
    assert StepErrors.of(scene_of(smooth(2), clear)) == StepErrors(0.0, 0.0)


@pytest.mark.parametrize("kind", ["<f4", ">i2", "<f8", "<f2"])
def test_the_kind_of_numbers_makes_no_difference(kind: str) -> None:
    """Of whole numbers that all of them hold."""
    values = smooth(3) // 2
    scene = scene_of(values, see_through(1.0))
    other = scene_of(values.astype(kind), see_through(1.0))
    assert StepErrors.of(other) == StepErrors.of(scene)


def test_millimetres_are_but_a_unit() -> None:
    """Voxels half as large and extinction twice as strong: the same picture."""
    scene = scene_of(smooth(4), see_through(1.0))
    volume = scene.volume
    half = replace(
        scene,
        volume=Volume(volume.values, volume.spacing_mm / 2, volume.origin_mm),
        transfer_function=see_through(2.0),
    )
    assert StepErrors.of(half) == StepErrors.of(scene)


@given(
    whole=st.floats(1e-8, 1), half=st.floats(1e-8, 1), tolerance=st.floats(1e-6, 0.9),
    own=st.floats(0.0625, 4), falls=st.lists(st.floats(0, 1), max_size=4),
)  # fmt: skip
def test_the_longest_step_that_will_do_is_taken(
    whole: float, half: float, tolerance: float, own: float, falls: list[float]
) -> None:
    finer = tuple(half * float(fall) for fall in np.cumprod(falls))
    estimate = StepErrors(whole, half, finer)
    step = estimate.step(replace(AIMED, step_voxels=own, tolerance=tolerance))
    assert own / 16 * (1 - 1e-12) <= step <= own
    if step < own:
        assert estimate.error(own) > tolerance
    if step > 0.0626 * own:
        assert estimate.error(step) <= tolerance
    # no shorter step than half a voxel is foretold to leave more
    steps = [0.5 * 0.8**k for k in range(12)]
    errors = [estimate.error(s) for s in steps]
    assert all(
        fine <= coarse * (1 + 1e-9) for coarse, fine in itertools.pairwise(errors)
    )
    # what was found is told
    for k, found in enumerate((whole, half, *finer)):
        assert estimate.error(0.5**k) == pytest.approx(found, rel=1e-9, abs=1e-9)


def test_all_ranks_take_the_same_steps() -> None:
    scene = scene_of(smooth(1), see_through(2.0))
    marches = [
        make_node(scene, "classic", AIMED, rank=rank, ranks=3)[0] for rank in range(3)
    ]
    (step,) = {march.quality.step_voxels for march in marches}
    assert step < AIMED.step_voxels


def test_a_quality_without_an_aim_is_taken_at_its_word() -> None:
    scene = scene_of(smooth(1), see_through(2.0))
    plain = replace(AIMED, tolerance=None)
    assert StepEstimate(scene, plain).quality is not None
    assert StepEstimate(scene, plain).quality == plain
    post = replace(AIMED, classification="post")
    assert StepEstimate(scene, post).quality == replace(post, tolerance=None)
    with pytest.raises(ValueError, match="tolerance must be between 0 and 1, got 0"):
        replace(AIMED, tolerance=0.0)


def test_numbers_that_are_not_finite_are_still_refused() -> None:
    values = smooth(5).astype(np.float32)
    values[3, 4, 5] = np.nan
    with pytest.raises(ValueError, match="not finite"):
        make_node(scene_of(values, see_through(1.0)), "classic", AIMED)


def test_a_long_thin_grid_is_errors_by_fewer_lines() -> None:
    """Else a million samples a line would be taken of spacings a thousand apart."""
    values = smooth(6, (2, 40, 3000))
    volume = Volume(values, np.array([5.0, 1.0, 0.001]), np.zeros(3))
    scene = Scene(volume, see_through(1.0), (), PhongMaterial(1, 0, 0))
    assert StepErrors.of(scene).error(1.0) >= 0
