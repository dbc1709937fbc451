import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.reference import box_interval, render_reference, sobel_gradient
from renderers.scene import (
    Camera,
    Light,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)
from renderers.scene.deflection import (
    Deflection,
    Deflector,
    Rotation,
    Scaling,
    Translation,
    deflected_volume,
)
from tests.slow_cases import slow

DIRECTIONS = [
    np.eye(3),
    np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    np.diag([-1.0, 1, 1]),
    np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0],
]


def constant_scene(kappa: float, color: float = 1.0, side_mm: float = 32) -> Scene:
    volume = Volume(
        np.zeros((9, 9, 9), np.int16), np.full(3, side_mm / 8), np.full(3, -side_mm / 2)
    )
    transfer = TransferFunction(
        np.array([-1.0, 1.0]), np.full((2, 3), color), np.full(2, kappa)
    )
    return Scene(volume, transfer)


def single_ray(eye: NDArray[np.float64], target: NDArray[np.float64]) -> Camera:
    up = np.eye(3)[int(np.argmin(np.abs(target - eye)))]
    return Camera.looking_at(
        eye, target, up=up, extent=0.01, size=(1, 1), projection=Projection.PERSPECTIVE
    )


def scalar_field(function: str, h: float, direction: NDArray[np.float64]) -> Volume:
    """Sample a field of the distance r from the middle on a 20 mm cube."""
    n = round(20 / h) + 1
    axis = (np.arange(n) - (n - 1) / 2) * h
    r = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    fields = {"sphere": np.clip(200 * (8 - r), -1000, 1000), "radius": r}
    corner = direction @ np.full(3, axis[0])
    return Volume(fields[function].astype(np.float32), np.full(3, h), corner, direction)


@pytest.mark.parametrize(
    ("angle_deg", "expected"), [(0, 0.806288515541499), (35, 0.865172839254449)]
)
def test_a_uniform_slab_follows_beer(angle_deg: float, expected: float) -> None:
    # Extinction .05 per mm as opacity, 32 mm; the oblique ray uses the same faces.
    scene = constant_scene(0.051293294387551)
    a = math.radians(angle_deg)
    direction = np.array([math.sin(a), math.cos(a), 0.0])
    camera = single_ray(-30 * direction, np.zeros(3))
    for step in (7.0, 0.31):
        rgba = render_reference(scene, camera, step)[0, 0]
        assert rgba == pytest.approx(np.full(4, expected), abs=1e-12)


def test_an_empty_volume_is_transparent() -> None:
    camera = single_ray(np.array([0, -40.0, 3]), np.zeros(3))
    assert not render_reference(constant_scene(0.0), camera, 0.5).any()


def test_an_opaque_wall_shows_its_own_color() -> None:
    camera = single_ray(np.array([0, -40.0, 3]), np.zeros(3))
    rgba = render_reference(constant_scene(16.0, 0.3), camera, 0.5)[0, 0]
    assert rgba == pytest.approx([0.3, 0.3, 0.3, 1.0], abs=1e-12)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_chords_of_a_sphere(direction: NDArray[np.float64]) -> None:
    volume = scalar_field("sphere", 0.5, direction)
    transfer = TransferFunction(
        np.array([-1000.0, -1e-6, 1e-6, 1000]),
        np.ones((4, 3)),
        np.array([0, 0, 0.1, 0.1]),
    )
    scene = Scene(volume, transfer)
    for b, expected in ((0.0, 0.798103482005345), (4.0, 0.749836517804238)):
        eye = direction @ np.array([b, -20.0, 0.013])
        camera = single_ray(eye, eye + direction @ np.array([0, 10.0, 0]))
        alpha = render_reference(scene, camera, 0.05, shaded=False)[0, 0, 3]
        # The chord of the trilinear sphere is shorter by about h^2 / 4R at both ends.
        assert alpha == pytest.approx(expected, abs=7e-3)


def test_a_ramp_converges_at_second_order() -> None:
    n = 33
    values = np.broadcast_to(np.arange(n, dtype=np.float32), (n, n, n)).copy()
    volume = Volume(values, np.ones(3), np.zeros(3))
    transfer = TransferFunction(
        np.array([0.0, 32.0]), np.array([[0.2] * 3, [1.0] * 3]), np.array([0.02, 0.148])
    )
    camera = single_ray(np.array([-5.0, 16, 16]), np.array([16.0, 16, 16]))
    scene = Scene(volume, transfer)
    tau = 0.02 * 32 + 0.004 * 32**2 / 2
    exact = render_reference(scene, camera, 32 / 1024, shaded=False)[0, 0]
    # The midpoint rule is exact on a linear extinction; colour errs at second order.
    assert exact[3] == pytest.approx(-math.expm1(-tau), abs=1e-12)
    error = [
        abs(render_reference(scene, camera, step, shaded=False)[0, 0, 0] - exact[0])
        for step in (4.0, 2.0, 1.0, 0.5)
    ]
    order = np.log2(np.array(error[:-1]) / error[1:])
    assert np.all(np.abs(order[-2:] - 2) < 0.15)


def test_a_gradient_of_a_plane_is_exact_at_any_spacing_and_direction() -> None:
    slope = np.array([3.0, -2.0, 0.5])
    for direction in DIRECTIONS:
        blank = Volume(
            np.zeros((5, 6, 7), np.float32),
            np.array([0.4, 0.4, 2.0]),
            np.array([1.0, 2, 3]),
            direction,
        )
        k, j, i = np.meshgrid(*(np.arange(n) for n in blank.shape), indexing="ij")
        points = np.stack([i, j, k, np.ones_like(i)], -1) @ blank.world_from_voxel.T
        plane = blank.with_values(points[..., :3] @ slope, 0.0)
        assert sobel_gradient(plane) == pytest.approx(
            np.broadcast_to(slope, (5, 6, 7, 3)), abs=1e-9
        )


def test_an_opaque_sphere_is_lit_by_lambert() -> None:
    volume = scalar_field("sphere", 0.4, np.eye(3))
    transfer = TransferFunction(
        np.array([-1000.0, -1e-6, 1e-6, 1000]),
        np.ones((4, 3)),
        np.array([0, 0, 400.0, 400]),
    )
    head_light = Light(np.array([0.0, -1, 0]), np.ones(3))
    scene = Scene(volume, transfer, (head_light,), PhongMaterial(0, 1, 0))
    for b, expected in ((0.0, 1.0), (4.0, 0.866025403784439)):
        camera = single_ray(np.array([b, -20.0, 0.01]), np.array([b, 0.0, 0.01]))
        assert render_reference(scene, camera, 0.05)[0, 0, 0] == pytest.approx(
            expected, abs=2e-2
        )


def test_the_interval_starts_at_an_eye_inside() -> None:
    volume = constant_scene(1.0).volume
    origins = np.array([[0.0, 0, 0], [0, -20, 0], [0, 20, 0], [40, 0, 0]])
    directions = np.tile([0.0, 1, 0], (4, 1))
    near, far = box_interval(volume, origins, directions)
    assert near[:2].tolist() == [0, 4]
    assert far[:2].tolist() == [16, 36]
    assert np.all(near[2:] >= far[2:])


@pytest.mark.parametrize("step", [0.0, -1.0, math.nan, math.inf])
def test_a_step_is_a_positive_length(step: float) -> None:
    camera = single_ray(np.array([0, -40.0, 3]), np.zeros(3))
    with pytest.raises(ValueError, match="step must be a positive length"):
        render_reference(constant_scene(1.0), camera, step)


MIDDLE = np.array([0.5, -1.0, 2.0])
BENT: list[Deflector] = [
    Translation(MIDDLE, 6.0, np.array([2.0, 2.0, -1.0])),
    Rotation(MIDDLE, 6.0, np.array([1.0, 2.0, 0.5]), 2.0),
    Scaling(MIDDLE, 6.0, 0.5),
    Scaling(MIDDLE, 6.0, 3.0),
]


@pytest.mark.parametrize("deflector", BENT, ids=lambda d: type(d).__name__)
def test_a_uniform_medium_stays_what_it_is_behind_a_deflector(
    deflector: Deflector,
) -> None:
    scene = constant_scene(0.051293294387551)
    for offset in ((0, 0, 0), (2.0, 0, 1.0), (-4.0, 0, 0.3)):
        eye = np.array([0.0, -30, 0]) + offset
        camera = single_ray(eye, MIDDLE + offset)
        straight = render_reference(scene, camera, 0.31)
        bent = render_reference(
            scene, camera, 0.31, deflection=Deflection((deflector,))
        )
        assert bent == pytest.approx(straight, rel=20 * 2**-23)


@pytest.mark.parametrize(
    "deflector", [BENT[1], *slow(BENT[0], *BENT[2:])], ids=lambda d: type(d).__name__
)
def test_bent_rays_show_the_deformed_volume(deflector: Deflector) -> None:
    """Normals too: lit by one light, a picture of the volume sampled at q(x)."""
    volume = scalar_field("sphere", 0.4, np.eye(3))
    transfer = TransferFunction(
        np.array([-1000.0, -200.0, 200.0, 1000]),
        np.ones((4, 3)),
        np.array([0, 0, 4.0, 4.0]),
    )
    light = Light(np.array([0.4, -1, 0.3]), np.ones(3))
    scene = Scene(volume, transfer, (light,), PhongMaterial(0.1, 0.9, 0))
    camera = Camera.looking_at(
        (6.0, -24, 4), (0, -4, 2), extent=0.4, size=(28, 28),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    # beside the sphere's middle, where turning shows
    deflection = Deflection((replace(deflector, center_mm=np.array([4.0, -6, 1])),))
    deformed = Scene(
        deflected_volume(volume, deflection), transfer, scene.lights, scene.material
    )
    bent = render_reference(scene, camera, 0.2, deflection=deflection)
    wanted = render_reference(deformed, camera, 0.2)
    plain = render_reference(scene, camera, 0.2)
    error = np.sqrt(np.mean((bent - wanted) ** 2))
    # interpolated twice, and gradients of 0.4 mm voxels where tissue is squeezed
    assert error < 0.03
    assert np.sqrt(np.mean((bent - plain) ** 2)) > 2 * error
