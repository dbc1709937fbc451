import itertools
import math

import numpy as np
import pytest

from renderers.art import ActiveRayTracer
from renderers.art.quality import QUALITIES, Quality
from renderers.scene import Camera, PhongMaterial, Scene, image_error

EXACT = Quality(0.5, 0.0)


def test_names_go_from_coarse_to_fine() -> None:
    qualities = [Quality.named(name) for name in QUALITIES]
    assert list(QUALITIES) == ["preview", "snapshot", "final", "reference"]
    for coarse, fine in itertools.pairwise(qualities):
        assert fine.step_voxels < coarse.step_voxels
        assert fine.cutoff < coarse.cutoff


@pytest.mark.parametrize("name", ["final", "reference"])
def test_the_best_are_never_renormalised(name: str) -> None:
    assert not Quality.named(name).renormalise
    assert not Quality.named(name).compact
    assert Quality.named(name).cutoff <= 1e-4


@pytest.mark.parametrize(
    ("step", "cutoff"), [*((s, 0.1) for s in (0, -1, 5, math.nan, math.inf)), (1, 0.5)]
)
def test_nonsense_is_refused(step: float, cutoff: float) -> None:
    with pytest.raises(ValueError, match="must be"):
        Quality(step, cutoff)


def test_an_unknown_name_lists_the_known() -> None:
    with pytest.raises(ValueError, match="preview, snapshot, final, reference"):
        Quality.named("ultra")


def test_compact_samples_change_a_picture_by_their_rounding(
    scene: Scene, outside: Camera
) -> None:
    """1/32767 voxel along y, and of the steepest gradient, which lights follow."""
    exact = ActiveRayTracer(scene, EXACT).render(outside).rgba
    quality = Quality(0.5, 0.0, compact=True)
    tracer = ActiveRayTracer(scene, quality)
    error = image_error(tracer.render(outside).rgba, exact)
    assert 0 < error.rmse < 5e-5
    assert error.max < 2e-3
    plain = Scene(scene.volume, scene.transfer_function, (), PhongMaterial(1, 0, 0))
    exact = ActiveRayTracer(plain, EXACT).render(outside).rgba
    error = image_error(ActiveRayTracer(plain, quality).render(outside).rgba, exact)
    # Extinction jumps within .01 HU: a density read anew may fall beside the jump.
    assert error.p999 < 1e-5


def test_a_volume_without_whole_numbers_is_never_made_compact(
    scene: Scene, outside: Camera
) -> None:
    halves = scene.volume.with_values(scene.volume.values / np.float32(2), -500)
    pictures = [
        ActiveRayTracer(
            Scene(halves, scene.transfer_function), Quality(0.5, 0.0, compact=compact)
        )
        .render(outside)
        .rgba
        for compact in (False, True)
    ]
    assert np.array_equal(pictures[0], pictures[1])


def test_a_cut_ray_leaves_out_no_more_than_the_cutoff(
    scene: Scene, outside: Camera
) -> None:
    whole = ActiveRayTracer(scene, EXACT).render(outside).rgba
    cut = ActiveRayTracer(scene, Quality(0.5, 0.02)).render(outside).rgba
    assert 0 < np.abs(whole - cut)[..., 3].max() <= 0.02
    full = Quality(0.5, 0.02, renormalise=True)
    alpha = ActiveRayTracer(scene, full).render(outside).rgba[..., 3]
    assert np.all((alpha == 1) == (whole[..., 3] > 0.98 - 1e-6) | (alpha == 1))
    assert np.all(alpha[cut[..., 3] > 0.98] == 1)
