"""Mitsuba sees the same walls in the same light: closed forms, then the nose."""

import math
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.light_witness import (
    BOUNCES,
    VIEWS,
    DiffuseRoom,
    Estimate,
    LightDifference,
)
from benchmarks.peers.light_jobs import LightJobs, mitsuba_process
from benchmarks.peers.peer_process import PeerProcess
from benchmarks.plan import UnavailableError
from renderers.scene import Camera, Projection, Volume
from renderers.shading import ScopeLight
from renderers.shading.kernels.elementary import NEAREST_MM2
from renderers.shading.kernels.path_tracing import LIFTED_MM
from renderers.shading.path_tracer import SOURCES
from system import UserError

RADIUS_MM = 8.0
RHO = np.array([0.6, 0.3, 0.1])
BULB = ScopeLight(ring_radius_mm=0.0, spread=0.0)
"""Shines alike in all directions, from the eye."""
SPACING_MM = 0.45
BELOW_FACETS = 0.007
"""What is known to part us from Mitsuba's own integrator (turbinate .5 %).
Normals are Sobel's, walls the zero set: a few rays begin below their own wall. Ours
meet it at once and go on; Mitsuba's end there. Where they begin above it as ours do,
nothing parts us."""
WAYS = [
    pytest.param(None, BELOW_FACETS, id="its own way"),
    pytest.param(LIFTED_MM, 0.0, id="off walls as ours"),
]


@pytest.fixture(scope="module")
def peer() -> Iterator[PeerProcess]:
    process = mitsuba_process()
    yield process
    process.close()


def field(of: str) -> Volume:
    """Give a ball of air about the origin, or air above a floor 6 mm below it."""
    at = (np.arange(45) - 22) * SPACING_MM
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    ball = np.sqrt(x * x + y * y + z * z) - RADIUS_MM
    distance = (ball if of == "ball" else -6.0 - z).astype(np.float32)
    return Volume(distance, np.full(3, SPACING_MM), np.full(3, at[0]), background=1.0)


def looking(eye: tuple[float, float, float], size: int = 12) -> Camera:
    return Camera.looking_at(
        eye,
        (0.3, 0.2, -6.0),
        up=(0, 1, 0),
        extent=math.radians(30),
        size=(size, size),
        projection=Projection.PERSPECTIVE,
    )


def asked(
    jobs: LightJobs,
    camera: Camera,
    light: ScopeLight,
    *,
    bounces: int,
    bounced_only: bool = True,
    refined: int = 1,
    lifted_mm: float | None = None,
) -> Estimate:
    """Let Mitsuba do it, or skip."""
    job = jobs.job(
        camera,
        light,
        paths=64,
        passes=16,
        bounces=bounces,
        bounced_only=bounced_only,
        refined=refined,
        lifted_mm=lifted_mm,
    )
    try:
        return Estimate.of_passes(jobs.passes(job)[0])
    except UnavailableError as error:
        pytest.skip(str(error))


@pytest.fixture
def jobs(peer: PeerProcess, request: pytest.FixtureRequest) -> LightJobs:
    try:
        return LightJobs(peer, field(request.param), RHO)
    except UnavailableError as error:
        pytest.skip(str(error))


def spot_law(
    camera: Camera, light: ScopeLight, nearest_mm2: float = NEAREST_MM2
) -> NDArray[np.float64]:
    """Give the irradiance of the floor behind each pixel, source by source."""
    origins, rays = camera.rays()
    points = origins + ((-6.0 - origins[..., 2]) / rays[..., 2])[..., None] * rays
    found = np.zeros(points.shape[:2])
    for source in light.sources(camera, SOURCES).astype(float) + camera.eye_mm:
        way = source - points
        squared = (way * way).sum(-1)
        way /= np.sqrt(squared)[..., None]
        spot = np.exp(-light.spread * (1 + way @ camera.frame[3]))
        squared = np.maximum(squared, nearest_mm2)
        found += light.power / SOURCES * spot * way[..., 2] / squared
    return found


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["floor"], indirect=True)
@pytest.mark.parametrize(
    ("eye", "ring_mm", "is_near"),
    [((2.0, -3.0, 1.0), 1.45, False), ((0.4, 0.1, -5.5), 0.3, True)],
    ids=["far", "nearer than a fibre end"],
)
def test_a_floor_under_the_scopes_ring_is_lit_as_the_law_says(
    jobs: LightJobs, eye: tuple[float, float, float], ring_mm: float, is_near: bool
) -> None:
    """Mirrored or turned pictures would not do: the view is oblique."""
    camera, light = looking(eye), ScopeLight(ring_mm, power=3.0)
    found = asked(jobs, camera, light, bounces=0, bounced_only=False)
    expected = spot_law(camera, light)
    # the limit of the near view makes it more even
    assert expected.max() > (1.5 if is_near else 2.0) * expected.min()
    without = spot_law(camera, light, nearest_mm2=0.0)
    assert (without.max() > 1.1 * expected.max()) == is_near
    apart = (found.mean[..., 0] - expected) / found.error[..., 0]
    assert math.sqrt((apart**2).mean()) == pytest.approx(1, abs=0.25)
    assert found.mean.mean() == pytest.approx(expected.mean(), rel=4e-3)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["ball"], indirect=True)
@pytest.mark.parametrize("lifted_mm", [None, LIFTED_MM])
@pytest.mark.parametrize("bounces", [1, 2, 40])
def test_a_ball_is_lit_as_an_integrating_sphere(
    jobs: LightJobs, bounces: int, lifted_mm: float | None
) -> None:
    camera = looking((1.0, -2.0, 2.5))
    found = asked(jobs, camera, BULB, bounces=bounces, lifted_mm=lifted_mm)
    series = sum(RHO**k for k in range(1, bounces + 1)) / RADIUS_MM**2
    np.testing.assert_allclose(found.mean.mean(axis=(0, 1)), series, rtol=0.01)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize(("lifted_mm", "parted"), WAYS)
def test_the_nose_is_lit_as_by_us(
    peer: PeerProcess, name: str, lifted_mm: float | None, parted: float
) -> None:
    """But for noise and the mesh's triangles, which finer ones show."""
    room = DiffuseRoom.at(name, 32)
    try:
        jobs = LightJobs(peer, room.surface.distance, room.albedo)
    except UnavailableError as error:
        pytest.skip(str(error))
    coarse, fine = (
        asked(
            jobs,
            room.camera,
            room.light,
            bounces=BOUNCES,
            refined=refined,
            lifted_mm=lifted_mm,
        )
        for refined in (1, 2)
    )
    mesh = abs(fine.mean.mean() / coarse.mean.mean() - 1)
    own, _ = room.bounced(batches=64)
    found = LightDifference.of(own, fine)
    assert abs(found.mean) < 3 * found.mean_error + mesh + parted


def test_a_lens_or_a_turned_grid_is_refused() -> None:
    grid = field("ball")
    a = math.radians(10)
    turn = [[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]]
    turned = Volume(
        grid.values, grid.spacing_mm, grid.origin_mm, np.array(turn), background=1.0
    )
    lens = replace(looking((0, 0, 0)), projection=Projection.EQUIDISTANT)
    # one of its own: where Mitsuba is not installed, what others asked has ended theirs
    with closing(mitsuba_process()) as peer:
        with pytest.raises(UserError, match="along the world's axes only"):
            LightJobs(peer, turned, RHO)
        with pytest.raises(UserError, match="square pinhole pictures only"):
            LightJobs(peer, grid, RHO).job(lens, BULB, paths=1, passes=2, bounces=1)
