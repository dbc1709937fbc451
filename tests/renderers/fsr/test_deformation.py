import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.fsr.deformation import (
    displace_surfels,
    displaced_covariances,
    largest_growth,
)
from renderers.fsr.surfels import SurfelRasterizer
from renderers.fsr.surfels.surfel_set import extract_surfels
from renderers.scene import Camera, Volume
from renderers.scene.deflection import (
    Cut,
    Deflection,
    Deflector,
    Rotation,
    Scaling,
    Translation,
    deflected_distance,
)
from renderers.scene.thread_pool import ThreadPool

WALL = np.array([6.0, 0.0, 0.0])
KINDS: dict[str, Deflector] = {
    "translation": Translation(WALL, 4.0, np.array([-1.5, 0.8, 0.0])),
    "rotation": Rotation(WALL, 4.0, np.array([0.0, 0.3, 1.0]), 0.9),
    "swelling": Scaling(WALL, 4.0, 1.8),
    "shrinking": Scaling(WALL, 4.0, 0.6),
    "cut": Cut(WALL - (1.2, 0, 0), 2.9, np.array([0.0, 1.0, 0.0]), 0.8),
}


def moved_part(
    volume: Volume, deflection: Deflection
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    surfels = displace_surfels(extract_surfels(volume), volume, deflection)
    x = surfels.position + volume.origin_mm
    inside = deflection.moves(x)
    return x[inside], surfels.normal[inside].astype(float)


def test_nothing_done_changes_no_bit_of_the_picture(
    hollow: Volume, pool: ThreadPool
) -> None:
    camera = Camera.looking_at((0.5, -2, 0), (6, 1, 0), size=(80, 80))
    still = Deflection((Translation(WALL, 4.0, np.zeros(3)),))
    a = SurfelRasterizer(hollow).draw(camera, pool)
    b = SurfelRasterizer(hollow, deflection=still).draw(camera, pool)
    # in the ball elements are taken in the order of their own grid
    seen = a.coverage > 0
    assert np.array_equal(seen, b.coverage > 0)
    assert np.abs(a.depth_mm[seen] - b.depth_mm[seen]).max() < 1e-4
    none = SurfelRasterizer(hollow, deflection=Deflection()).draw(camera, pool)
    assert np.array_equal(a.depth_mm, none.depth_mm)
    assert np.array_equal(a.normal, none.normal)


@pytest.mark.parametrize("name", ["translation", "rotation", "swelling", "shrinking"])
def test_displaced_splats_are_on_the_surface_that_rays_meet(
    hollow: Volume, name: str
) -> None:
    """Their pull-back is on the undeformed sphere; normals are its image's."""
    deflection = Deflection((KINDS[name],))
    x, normals = moved_part(hollow, deflection)
    assert len(x) > 100
    q = deflection.pull_back(x)
    # float32 places; what is left is the surfels' own distance from the zero set
    assert np.abs(hollow.sample(q)).max() < 2e-3
    assert np.abs(deflection.push_forward(q) - x).max() < 1e-6
    # the gradient of |q(x)| by differences
    step = 1e-5
    rise = [
        np.linalg.norm(deflection.pull_back(x + h), axis=1)
        - np.linalg.norm(deflection.pull_back(x - h), axis=1)
        for h in step * np.eye(3)
    ]
    wanted = -np.stack(rise, axis=-1)
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    angle = np.degrees(np.arccos(np.clip((normals * wanted).sum(axis=1), -1, 1)))
    assert angle.mean() < 1.5
    assert angle.max() < 6.0


@pytest.mark.parametrize("name", list(KINDS))
def test_a_footprint_is_the_spread_of_its_own_points(name: str) -> None:
    deflector = KINDS[name]
    rng = np.random.default_rng(2)
    q = WALL + rng.uniform(0.3, 1.2, (20, 3))
    cloud = 1e-4 * rng.normal(size=(4000, 3)) @ np.diag([1.0, 2.0, 0.5])
    before = np.cov(cloud.T)
    jacobian = deflector.jacobian(deflector.push_forward(q))
    wanted = displaced_covariances(np.broadcast_to(before, (20, 3, 3)), jacobian)
    for place, covariance in zip(q, wanted, strict=True):
        spread = np.cov(deflector.push_forward(place + cloud).T)
        assert np.abs(spread - covariance).max() < 2e-3 * np.abs(covariance).max()


def test_growth_is_the_widest_footprints() -> None:
    normals = np.array([[0.0, 0, 1]])
    for stretch in (0.5, 1.0, 3.0):
        # dq/dx of a stretch along x; one across the disc would not count
        jacobian = np.diag([1 / stretch, 1.0, 0.01])[None]
        assert largest_growth(normals, jacobian) == pytest.approx(max(stretch, 1.0))
    assert largest_growth(normals[:0], np.empty((0, 3, 3))) == 1.0


@pytest.mark.parametrize(
    "name",
    [
        n if n in ("rotation", "cut") else pytest.param(n, marks=pytest.mark.slow)
        for n in KINDS
    ],
)
def test_depth_agrees_with_rays_into_the_deformed_field(
    hollow: Volume, pool: ThreadPool, name: str
) -> None:
    deflection = Deflection((KINDS[name],))
    camera = Camera.looking_at((-1.0, -1.0, 0.3), (6, 0.2, 0), size=(72, 72))
    g = SurfelRasterizer(hollow, deflection=deflection).draw(camera, pool)
    seen = np.any(camera.lens_table() != 0, axis=-1)
    assert np.all(g.coverage[seen] == 1), "no holes"
    field = deflected_distance(hollow, deflection)
    # every other row and column: rays through the deformed field are slow
    asked = np.zeros_like(seen)
    asked[::2, ::2] = seen[::2, ::2]
    origin, ray = camera.rays()
    t = np.arange(0.0, 14.0, 0.02)
    points = origin[asked][:, None] + t[:, None] * ray[asked][:, None]
    depth = t[np.argmax(field.sample(points) > 0, axis=1)]
    off = np.abs(g.depth_mm[asked] - depth)
    assert np.median(off) < 0.03
    # silhouettes grow by a fraction of a disc
    assert np.mean(off > 0.5) < (0.06 if name == "cut" else 0.02)


def test_swollen_tissue_has_no_holes(hollow: Volume, pool: ThreadPool) -> None:
    """Stretched four times, by discs that keep their size."""
    deflection = Deflection((Scaling(WALL, 5.0, 4.0),))
    surfels = extract_surfels(hollow)
    moved = displace_surfels(surfels, hollow, deflection)
    assert len(moved) > 1.5 * len(surfels)
    camera = Camera.looking_at((0.0, 0, 0), WALL, size=(64, 64), extent=0.5)
    g = SurfelRasterizer(hollow, deflection=deflection).draw(camera, pool)
    assert g.coverage[np.any(camera.lens_table() != 0, axis=-1)].all()
