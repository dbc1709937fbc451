"""A peer's time counts only with a right picture."""

import numpy as np

from benchmarks.gallery.classic_studio import (
    COARSE_RIGHT,
    RIGHT,
    THINNING,
    checked,
    panel,
    see_through,
)
from benchmarks.gallery.panel import Panel
from benchmarks.scenes import SubjectSource
from benchmarks.timing import Timing
from renderers.art import ActiveRayTracer
from renderers.scene import Projection

TIME = Timing(0.1, 0.1, 0.1, 1)
RNG = np.random.default_rng(3)
SMOOTH = np.linspace(0.1, 0.6, 32, dtype=np.float32)
TRUTH = np.stack([np.add.outer(SMOOTH, SMOOTH**2)] * 3, axis=-1)
TRUTH[8:14, 20:26] = 0.05


def peer(linear: np.ndarray) -> Panel:
    return checked("peer", linear, TIME, (TRUTH, TRUTH), RIGHT)


def test_the_reference_is_itself_to_the_bit() -> None:
    found = panel("reference", TRUTH, TIME, TRUTH)
    assert (found.error, found.alike, found.cpu_s) == (0.0, 1.0, TIME.cpu_s)


def test_a_picture_with_noise_of_a_code_is_right() -> None:
    noise = RNG.normal(0, 1 / 255, TRUTH.shape).astype(np.float32)
    found = peer(np.clip(TRUTH + noise, 0, 1))
    assert found.cpu_s == TIME.cpu_s
    assert found.why == ""
    assert 0 < found.error < RIGHT[0]


def test_wrong_pictures_keep_their_error_but_have_no_time() -> None:
    wrong = {
        "mirrored": TRUTH[:, ::-1],
        "upside down": TRUTH[::-1],
        "ambient light without colour": np.clip(TRUTH + 0.25, 0, 1),
        "nothing": np.zeros_like(TRUTH),
    }
    for name, linear in wrong.items():
        found = peer(np.ascontiguousarray(linear))
        assert found.cpu_s is None, name
        assert found.why, name
        assert found.error > 0, name


def test_it_is_checked_against_what_it_should_have_drawn() -> None:
    blurred = np.full_like(TRUTH, TRUTH.mean())
    found = checked("splats", blurred, TIME, (TRUTH, blurred), COARSE_RIGHT)
    assert found.cpu_s == TIME.cpu_s
    assert found.error > COARSE_RIGHT[0]


def test_thin_tissue_has_the_same_colours_and_is_seen_through(
    ball: SubjectSource,
) -> None:
    scene = ball.subject.scene
    thin = see_through(scene)
    given, found = scene.transfer_function, thin.transfer_function
    np.testing.assert_array_equal(found.color, given.color)
    np.testing.assert_allclose(found.kappa_per_mm, THINNING * given.kappa_per_mm)
    camera = ball.subject.views["outside"].camera(32, Projection.PERSPECTIVE)
    alpha = [ActiveRayTracer(s).render(camera).rgba[..., 3] for s in (scene, thin)]
    opaque = alpha[0] > 0.99
    assert opaque.sum() > 100
    assert 0.1 < alpha[1][opaque].min() < 0.3
    assert np.all(alpha[1] <= alpha[0] + 1e-3)
