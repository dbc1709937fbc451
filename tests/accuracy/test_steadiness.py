"""A moving picture must not flicker: tissue stays on its walls, glints slide.

The bound on the mean is a design figure; the others are somewhat above what was
measured on these views. Noise is off and the gain held, so that all change is the
renderer's.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, gaussian_filter, map_coordinates

from benchmarks.nasal_views import NasalView, acceptance_views, nasal_scene
from renderers.fsr import FuzzySetRenderer
from renderers.scene import Camera, GBuffer
from renderers.shading import CameraPass, CameraSettings, ScopeShader, Tier
from scenarios import Endoscope, tip_frame
from tests.slow_cases import slow
from tests.steadiness import carried, change, glints, orbited, shifted

SIZE = 384
STEP_MM = 0.05
FRAMES = 6
MOST_MEAN_CODES = 3.0
MOST_P99_CODES = 12.0
"""Measured 2.6 to 7 on these ways; 21 with 64 virtual lights, one of which jumped from
wall to wall."""

Picture = NDArray[np.float64]


class Film:
    """Take pictures of one head, grain off, the first one's gain held."""

    def __init__(self, head: str = "default") -> None:
        self.scene = nasal_scene(head)
        assert self.scene.surface is not None
        self._splats = FuzzySetRenderer(self.scene)
        self._shader = ScopeShader(self.scene.surface, Tier.LIVE)
        self._camera_pass = CameraPass(CameraSettings(noise=0))

    def take(
        self, view: NasalView, camera: Camera, gain: float | None
    ) -> tuple[Picture, GBuffer, float]:
        buffer = self._splats.gbuffer(camera)
        radiance = self._shader.shade(buffer, camera, view.light)
        pixels, gain = self._camera_pass.finish(radiance, buffer, camera, gain=gain)
        return pixels.astype(np.float64), buffer, gain

    def close(self) -> None:
        self._splats.close()
        self._shader.close()
        self._camera_pass.close()


@pytest.fixture(scope="module")
def film() -> Iterator[Film]:
    film = Film()
    yield film
    film.close()


def named(name: str, size: int = SIZE) -> NasalView:
    (view,) = (view for view in acceptance_views(size) if view.name == name)
    return view


def forwards(camera: Camera, frame: int) -> Camera:
    return shifted(camera, STEP_MM * frame)


def sideways(camera: Camera, frame: int) -> Camera:
    return orbited(camera, 400.0, STEP_MM * frame)


def largest_change(
    film: Film, view: NasalView, way: Callable[[Camera, int], Camera]
) -> tuple[float, float, float]:
    """Fly a few steps; give the worst mean and 99th percentile and the least share."""
    gain: float | None = None
    taken = []
    for frame in range(FRAMES):
        camera = way(view.camera, frame)
        picture, buffer, gain = film.take(view, camera, gain)
        taken.append((picture, camera, buffer))
    found = []
    for before, (picture, camera, buffer) in pairwise(taken):
        predicted, usable = carried(*before, camera, buffer)
        found.append(change(picture, predicted, usable, camera))
    return (
        max(c.mean for c in found),
        max(c.p99 for c in found),
        min(c.share for c in found),
    )


@pytest.mark.parametrize("way", [forwards, sideways])
@pytest.mark.parametrize(
    "name", ["middle meatus", *slow("vestibule", "turbinate", "recess", "choana")]
)
def test_a_frame_is_the_one_before_carried_along(
    film: Film, name: str, way: Callable[[Camera, int], Camera]
) -> None:
    mean, p99, share = largest_change(film, named(name), way)
    assert share > 0.7
    assert mean <= MOST_MEAN_CODES
    assert p99 <= MOST_P99_CODES


@pytest.mark.slow
def test_round_an_orbit_glints_slide_and_vessels_stay(film: Film) -> None:
    view = named("choana", 512)
    gain: float | None = None
    taken = []
    for step_mm in (0.0, 1.0, 3.0):
        camera = orbited(view.camera, 22.0, step_mm)
        picture, buffer, gain = film.take(view, camera, gain)
        taken.append((picture, camera, buffer))
    for (after, camera, buffer), stays in ((taken[1], 0.9), (taken[2], 0.5)):
        predicted, usable = carried(*taken[0], camera, buffer)
        was, now = glints(predicted) & usable, glints(after) & usable
        assert was.sum() > 20
        assert now.sum() > 20
        # glued to the wall all of them would be where they were
        assert (was & now).sum() < stays * min(was.sum(), now.sum())
        # vessels and mottle: what varies over a few pixels agrees, out of the reach of
        # `detail` from glints and from what cannot be carried
        bright = np.maximum(predicted.min(axis=-1), after.min(axis=-1)) > 110
        calm = ~binary_dilation(bright | ~usable, iterations=12)
        green = detail(after[..., 1])[calm]
        kept = np.corrcoef(green, detail(predicted[..., 1])[calm])[0, 1]
        left = np.corrcoef(green, detail(taken[0][0][..., 1])[calm])[0, 1]
        assert kept > 0.93
        assert left < 0.8


def detail(codes: Picture) -> Picture:
    """Leave what varies over 2 to 8 pixels."""
    result: Picture = gaussian_filter(codes, 1.0) - gaussian_filter(codes, 5.0)
    return result


@pytest.mark.slow
def test_turning_the_light_post_moves_the_view_and_not_the_horizon(film: Film) -> None:
    """30 degree scope, post once round: up stays up, and the wall turns by nothing."""
    scope = Endoscope(4.0, 30.0, 88.0, ring_radius_mm=1.45)
    view = named("choana")
    tip = tip_frame(view.camera.eye_mm, view.camera.frame[3])
    gain: float | None = None
    before: tuple[Picture, Camera, GBuffer] | None = None
    axes = []
    for roll in range(0, 361, 5):
        camera = scope.camera(tip, float(roll), (SIZE, SIZE))
        _, right, up, _ = camera.frame
        assert abs(right[2]) < 1e-12
        assert up[2] > 0.5
        axes.append(camera.frame[3])
        if roll % 90 and roll not in (5, 185):
            continue
        picture, buffer, gain = film.take(view, camera, gain)
        if before is not None and roll in (5, 185):
            predicted, usable = carried(*before, camera, buffer)
            assert usable.mean() > 0.3
            calm = usable & (predicted.min(axis=-1) < 120)
            calm &= picture.min(axis=-1) < 120
            off = np.abs(picture - predicted).max(axis=-1)[calm]
            # the spot turns with the view, so that light changes but walls do not
            assert np.median(off) < 8
        before = picture, camera, buffer
    tilt = np.degrees(np.arccos(np.clip(axes @ -tip[:3, 2], -1, 1)))
    np.testing.assert_allclose(tilt, 30, atol=1e-6)
    np.testing.assert_allclose(axes[0], axes[-1], atol=1e-9)


def test_hairs_neither_flicker_nor_jump(film: Film) -> None:
    """A hair goes where its root goes: its own points carried along, not the wall's."""
    surface = film.scene.surface
    assert surface is not None
    view = named("vestibule")
    from renderers.shading import Effects
    from renderers.shading.strands import Strands

    strands = Strands.grow(surface, 7)
    bald = ScopeShader(surface, Tier.LIVE, effects=Effects.none())
    hairy = ScopeShader(surface, Tier.LIVE, effects=Effects(False, True, False))
    darkness = []
    for frame in range(8):
        camera = shifted(view.camera, 0.02 * frame)
        _, buffer, _ = film.take(view, camera, None)
        bare = bald.shade(buffer, camera, view.light)
        seen = hairy.shade(buffer, camera, view.light)
        taken = np.clip(1 - seen[..., 0] / np.maximum(bare[..., 0], 1e-9), 0, 1)
        darkness.append(float(taken.sum()))
        position, away = camera.project(strands.points_mm[:, 4])
        at = np.stack([position[:, 1] - 0.5, position[:, 0] - 0.5])
        depth = map_coordinates(buffer.depth_mm, at, order=0, mode="constant")
        within = (away > 2) & (away < depth - 0.3) & (away < 20)
        on_hair = map_coordinates(taken, at, order=1, mode="constant")[within]
        assert within.sum() > 5
        # hairs that are lit as their wall is may be as bright as it
        assert np.median(on_hair) > 0.3
    assert max(darkness) < 1.1 * min(darkness)
    bald.close()
    hairy.close()
