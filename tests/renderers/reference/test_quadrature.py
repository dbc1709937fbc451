"""Two-point Gauss steps: closed forms to 1e-9, fourth order, kinks found."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.reference import gauss_ray, kinks, render_reference
from renderers.reference.quadrature import Medium, faces, steps_between
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)
from renderers.scene.deflection import Deflection, Scaling
from tests.accuracy.known_rays import LENGTH, RAYS, Ray

F64 = NDArray[np.float64]


def medium(ray: Ray) -> Medium:
    """Give what lies along a ray as the rule asks for it."""
    return lambda s: (ray.color(s)[:, None], ray.kappa(s))


@pytest.mark.parametrize("name", RAYS)
def test_the_closed_forms_to_nine_digits(name: str) -> None:
    ray = RAYS[name]
    cuts = np.linspace(0, LENGTH, 513)
    if ray.jump is not None:
        cuts = steps_between(np.array([0, ray.jump, LENGTH]), LENGTH / 512)
    light, clear = gauss_ray(medium(ray), cuts)
    assert light[0] == pytest.approx(ray.light, abs=1e-9)
    assert clear == pytest.approx(ray.clear, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "column"),
    [("exponential extinction", 1), ("linear colour", 0), ("cosine colour", 0)],
)
def test_it_is_of_fourth_order(name: str, column: int) -> None:
    ray, errors = RAYS[name], []
    for n in (16, 32, 64, 128):
        light, clear = gauss_ray(medium(ray), np.linspace(0, LENGTH, n + 1))
        found = float(light[0]), clear
        errors.append(abs(found[column] - (ray.light, ray.clear)[column]))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4, abs=0.15)


@given(
    coefficients=st.lists(st.floats(-9, 9), min_size=4, max_size=4),
    node=st.floats(-5, 5),
)
def test_every_crossing_of_a_cubic_is_found(
    coefficients: list[float], node: float
) -> None:
    ends = np.array([-1.0, 0.25, 2.0])

    def cubic(t: F64) -> F64:
        return np.asarray(np.polyval(coefficients, t), dtype=np.float64)

    found = kinks(cubic, ends, np.array([node]))
    size = np.abs(cubic(np.linspace(-1, 2, 50))).max() + abs(node) + 1
    assert np.all((found >= -1) & (found <= 2))
    # steep or touching: the value tells, the place may be vague
    assert np.abs(cubic(found) - node).max(initial=0) < 1e-9 * size
    fine = np.linspace(-1, 2, 4001)
    side = cubic(fine) >= node
    changes = np.flatnonzero(side[1:] != side[:-1])
    for k in changes:
        near = (found > fine[k] - 1e-3) & (found < fine[k + 1] + 1e-3)
        assert near.any()


def test_faces_are_where_whole_voxels_are() -> None:
    start, rate = np.array([0.25, 3.0, 1.5]), np.array([0.5, -1.0, 0.0])
    found = faces(start, rate, 0.0, 3.0)
    assert found == pytest.approx([0, 1, 1.5, 2, 3])


def ramp_scene(length: int, nodes: object, kappa: object, gray: object) -> Scene:
    """Fill a wide slab with its own depth."""
    depth = np.arange(length + 1, dtype=np.float32)
    values = np.broadcast_to(depth[:, None], (3, length + 1, 3))
    volume = Volume(
        np.ascontiguousarray(values),
        np.array([99.0, 1.0, 99.0]),
        np.array([-99.0, 0, -99.0]),
    )
    at = np.asarray(nodes, float)
    color = np.repeat(np.broadcast_to(np.asarray(gray, float), at.shape)[:, None], 3, 1)
    transfer = TransferFunction(at, color, np.broadcast_to(np.asarray(kappa), at.shape))
    return Scene(volume, transfer, (), PhongMaterial(1, 0, 0))


def one(scene: Scene, angle_deg: float = 0.0, step: float = 0.25) -> F64:
    a = math.radians(angle_deg)
    way = np.array([math.sin(a), math.cos(a), 0.0])
    camera = Camera.looking_at(
        [0.3, -5.0, 0.2], np.array([0.3, -5, 0.2]) + way, extent=1e-9, size=(1, 1),
        projection=Projection.ORTHOGRAPHIC,
    )  # fmt: skip
    pixel: F64 = render_reference(scene, camera, step, rule="gauss")[0, 0]
    return pixel


@pytest.mark.parametrize(
    ("scene", "light", "alpha"),
    [
        (
            ramp_scene(32, [-1, 99], -math.log1p(-0.05), 1.0),
            0.806288515541499,
            0.806288515541499,
        ),
        (
            ramp_scene(32, [0, 32], [0.02, 0.148], 1.0),
            0.931983162897063,
            0.931983162897063,
        ),
        (
            ramp_scene(
                32,
                [0, 10.3 - 1e-12, 10.3, 32],
                [0.03, 0.03, 0.3, 0.3],
                [0.8, 0.8, 0.2, 0.2],
            ),
            0.359272975346393,
            0.998907186810756,
        ),
        (ramp_scene(30, [0, 30], 0.1, [0.2, 0.8]), 0.350212931632136, None),
    ],
    ids=["S1", "S5", "S6", "S10"],
)
def test_scenes_with_closed_forms_to_nine_digits(
    scene: Scene, light: float, alpha: float | None
) -> None:
    found = one(scene)
    assert found[0] == pytest.approx(light, abs=1e-9)
    if alpha is not None:
        assert found[3] == pytest.approx(alpha, abs=1e-9)


def rough(transfer: TransferFunction) -> tuple[Scene, Camera]:
    """Make noise from voxel to voxel, and look at it aslant."""
    values = np.random.default_rng(6).uniform(-100, 100, (6, 7, 5))
    volume = Volume(values, np.array([1.0, 0.8, 1.3]), np.array([-2.0, -3, -2]))
    camera = Camera.looking_at(
        [-7.0, -9, 4], [0.3, -0.4, 0.2], extent=0.2, size=(3, 3),
        projection=Projection.PERSPECTIVE,
    )  # fmt: skip
    return Scene(volume, transfer, (), PhongMaterial(0.4, 0, 0)), camera


def test_noise_between_its_kinks_is_of_fourth_order() -> None:
    transfer = TransferFunction(
        np.array([-40.0, 90]),
        np.array([[0.1, 0.5, 0.9], [0.7, 0.2, 0]]),
        np.array([0, 2]),
    )
    scene, camera = rough(transfer)
    truth = render_reference(scene, camera, 1 / 128, rule="gauss")
    assert truth[..., 3].max() > 0.5
    errors = [
        np.abs(render_reference(scene, camera, step, rule="gauss") - truth).max()
        for step in (0.25, 0.125, 0.0625)
    ]
    assert errors[-1] < 1e-6
    # pieces between kinks are not all halved when the step is
    assert math.log2(errors[0] / errors[-1]) / 2 == pytest.approx(4, abs=0.6)


def test_spikes_and_jumps_in_noise_are_not_missed() -> None:
    nodes = np.array([-40.0, -5, 0, 5, 30, 30.001, 90])
    transfer = TransferFunction(
        nodes,
        np.random.default_rng(7).random((7, 3)),
        np.array([0, 0, 3, 0.1, 0.1, 1, 2]),
    )
    scene, camera = rough(transfer)
    fine, finer = (
        render_reference(scene, camera, step, rule="gauss")
        for step in (1 / 64, 1 / 128)
    )
    error = np.abs(fine - finer).max()
    assert error < 1e-6
    plain = render_reference(scene, camera, 1 / 64)
    assert np.abs(plain - finer).max() > 100 * error


def test_bent_rays_are_refused() -> None:
    scene, camera = rough(TransferFunction(np.arange(2.0), np.ones((2, 3)), np.ones(2)))
    ball = Deflection((Scaling(np.zeros(3), 2.0, 1.5),))
    with pytest.raises(ValueError, match="take rule midpoint"):
        render_reference(scene, camera, 0.5, rule="gauss", deflection=ball)
