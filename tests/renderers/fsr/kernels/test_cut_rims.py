"""Rays are followed to where tissue begins; normals are those of both renderers."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.cut_rims import follow, gradient_at, look
from renderers.scene import Volume
from renderers.scene.deflection import Cut, Deflection, maps_of
from tests.renderers.fsr.plain_gradients import sobel_gradient

CUT = Cut(np.array([5.0, 0.5, 0.0]), 3.0, np.array([0.2, 1.0, 0.1]), 0.7)


def in_voxels_mm(volume: Volume, x: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray((x - volume.origin_mm) @ volume.direction)


def test_gradients_are_those_of_voxels_interpolated() -> None:
    """In any frame, with voxels of any sides, on the grid's faces as well."""
    rng = np.random.default_rng(3)
    direction = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    values = rng.normal(size=(7, 6, 8)).astype(np.float32)
    spacing = np.array([0.5, 0.8, 1.1])
    volume = Volume(values, spacing, np.array([2.0, -1, 4]), direction)
    gradients = sobel_gradient(volume)
    parts = [volume.with_values(gradients[..., k], 0.0) for k in range(3)]
    # not on the last planes, where rounding may take a place for one outside
    voxel = rng.uniform(0, np.array([7, 5, 6]) - 1e-6, (300, 3))
    voxel[:20, 0] = 1e-6
    place = voxel * volume.spacing_mm
    world = place @ direction.T + volume.origin_mm
    wanted = np.stack([part.sample(world) for part in parts], axis=1)
    found = np.empty_like(place)
    for at, out in zip(place, found, strict=True):
        gradient_at(values, 1 / spacing, at, out)
    np.testing.assert_allclose(found @ direction.T, wanted, atol=2e-6)


def test_what_is_looked_at_is_what_the_deflection_shows(hollow: Volume) -> None:
    deflection = Deflection((CUT,))
    maps, per_mm = maps_of(deflection, hollow), 1 / hollow.spacing_mm
    x = CUT.center_mm + np.random.default_rng(5).uniform(-2.5, 2.5, (200, 3))
    seen, trail = np.empty(3), np.empty((1, 3))
    found = [
        look(hollow.values, per_mm, maps, place, seen, trail)
        for place in in_voxels_mm(hollow, x)
    ]
    inside, opening = np.array(found).T
    np.testing.assert_allclose(
        inside, hollow.sample(deflection.pull_back(x)), atol=5e-6
    )
    np.testing.assert_allclose(opening, deflection.opening(x), atol=1e-12)


def test_rays_end_at_the_first_tissue(hollow: Volume) -> None:
    """At what steps of a hundredth of a millimetre meet first, but finer."""
    deflection = Deflection((CUT,))
    maps, per_mm = maps_of(deflection, hollow), 1 / hollow.spacing_mm
    rng = np.random.default_rng(8)
    ways = np.array([1.0, 0, 0]) + rng.uniform(-0.5, 0.5, (150, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    steps = np.arange(0, 9.5, 0.01)
    eye = np.array([0.3, -0.4, 0.2])
    room, trail = np.empty((2, 3)), np.empty((1, 3))
    for way in ways:
        x = eye + steps[:, None] * way
        tissue = hollow.sample(deflection.pull_back(x)) >= 0
        tissue &= deflection.opening(x) >= 0
        at = follow(
            hollow.values, per_mm, maps, deflection.stretch,
            in_voxels_mm(hollow, eye), hollow.direction.T @ way, 0.0, room, trail,
        )  # fmt: skip
        first = steps[np.argmax(tissue)]
        # thinner than a step is the very edge of a rim
        assert at <= first + 1e-3
        assert first - at < 0.011 or at < first
        assert (
            abs(
                min(
                    hollow.sample(deflection.pull_back((eye + at * way)[None]))[0],
                    deflection.opening((eye + at * way)[None])[0],
                )
            )
            < 1e-3
        )


def test_who_begins_in_tissue_or_leaves_the_grid_finds_nothing(hollow: Volume) -> None:
    maps, per_mm = maps_of(Deflection((CUT,)), hollow), 1 / hollow.spacing_mm
    room, trail = np.empty((2, 3)), np.empty((1, 3))
    up = np.array([0.0, 0.0, 1.0])
    for place in (np.array([0, 0, 7.0]), np.array([20.0, 0, 0])):
        eye = in_voxels_mm(hollow, place)
        assert follow(hollow.values, per_mm, maps, 1.5, eye, up, 0.0, room, trail) == -1
