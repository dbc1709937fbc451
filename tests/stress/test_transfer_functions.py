"""Transfer functions at the edges: jumps, overflow, what lies outside their nodes."""

import math
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer, Quality
from renderers.art.quality import ClassificationName
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
    extinction_from_opacity,
)

PLAIN = PhongMaterial(1, 0, 0)
GRAY = np.full((2, 3), 0.5)


def slab(value: float, length_mm: float = 8.0) -> Volume:
    return Volume(
        np.full((3, 9, 3), value, np.float32),
        np.array([1.0, length_mm / 8, 1.0]),
        np.array([-1.0, 0, -1]),
    )


def seen_through(volume: Volume, transfer: TransferFunction) -> NDArray[np.float32]:
    camera = Camera.looking_at(
        [0, -5.0, 0], [0, 1.0, 0], extent=1e-3, size=(1, 1),
        projection=Projection.ORTHOGRAPHIC,
    )  # fmt: skip
    scene = Scene(volume, transfer, (), PLAIN)
    post, integrated = (
        ActiveRayTracer(scene, Quality(0.5, 0.0, classification=kind), threads=1)
        .render(camera)
        .rgba[0, 0]
        for kind in get_args(ClassificationName)
    )
    # densities do not change along the ray: both see the same
    assert integrated == pytest.approx(post, rel=1e-6, abs=1e-30)
    return np.asarray(post)


@pytest.mark.parametrize("at", [0.0, -480.0, 10.3, 3e4, -1e-5])
@pytest.mark.parametrize("others", [True, False])
def test_two_nodes_at_one_density_are_a_jump(at: float, others: bool) -> None:
    """Right-continuous: the density itself has what the second node says."""
    nodes, kappa = np.array([at, at]), np.array([0.03, 0.3])
    color = np.array([[0.8] * 3, [0.2] * 3])
    if others:
        nodes = np.array([at - 100, at, at, at + 100])
        kappa, color = np.repeat(kappa, 2), np.repeat(color, 2, axis=0)
    transfer = TransferFunction(nodes, color, kappa)
    step = max(abs(at), 1.0) * 1e-4
    for density, k in ((at - step, 0), (at, -1), (at + step, -1)):
        alpha = -math.expm1(-8 * kappa[k])
        found = seen_through(slab(density), transfer)
        # float32 tells 3e4 from its neighbours by 2e-3, and that is the jump
        wanted = [alpha * color[k, 0]] * 3 + [alpha]
        assert found == pytest.approx(wanted, abs=1e-5)


@pytest.mark.parametrize("opacity", [-0.001, 1.001, math.nan])
def test_opacity_beyond_its_range_is_refused(opacity: float) -> None:
    with pytest.raises(ValueError, match=f"from 0 to 1, got.*{opacity}"):
        extinction_from_opacity(np.array([0.5, opacity]), 1.0)


@pytest.mark.parametrize("value", [-1e6, -50.0, 350.0, 1e6])
def test_beyond_the_nodes_the_ends_hold(value: float) -> None:
    transfer = TransferFunction(
        np.array([0.0, 300.0]), np.array([[0.2] * 3, [0.8] * 3]), np.array([0.1, 0.3])
    )
    kappa, gray = (0.1, 0.2) if value < 0 else (0.3, 0.8)
    alpha = -math.expm1(-kappa * 8)
    found = seen_through(slab(value), transfer)
    assert found == pytest.approx([gray * alpha] * 3 + [alpha], abs=1e-6)


@pytest.mark.parametrize("width", [1e-4, 1e-3, 0.05])
def test_a_band_narrower_than_any_bin_is_found(width: float) -> None:
    """One part in ten million of the range of densities, anywhere in it."""
    for at in (-437.3, 0.0, 100.0, 811.7):
        # What float32 makes of the place is where the band has to be.
        middle = float(np.float32(at))
        nodes = np.array([-1000, middle - width, middle, middle + width, 1000])
        kappa = np.array([0.0, 0, 0.25, 0, 0])
        transfer = TransferFunction(nodes, np.ones((5, 3)), kappa)
        inside = seen_through(slab(middle), transfer)[3]
        assert inside == pytest.approx(-math.expm1(-0.25 * 8), rel=1e-3)
        for beside in (middle - 2 * width - 0.001, middle + 2 * width + 0.001):
            assert seen_through(slab(beside), transfer)[3] == 0


@pytest.mark.parametrize("length", [1e-3, 1.0, 1e4])
def test_the_most_opaque_is_finite_and_opaque(length: float) -> None:
    """Opacity 1 in a millionth of a millimetre."""
    transfer = TransferFunction.from_opacity(np.array([0.0, 1]), GRAY, np.ones(2), 1e-6)
    found = seen_through(slab(0.5, length), transfer)
    assert found.tolist() == [0.5, 0.5, 0.5, 1.0]


@pytest.mark.parametrize("kind", get_args(ClassificationName))
def test_a_function_edited_while_it_is_drawn_changes_no_picture(
    kind: ClassificationName,
) -> None:
    """A picture has the function that its scene was given, whatever becomes of it."""
    nodes, color = np.array([0.0, 300.0]), np.array([[0.2] * 3, [0.8] * 3])
    kappa = np.array([0.01, 0.3])
    values = np.random.default_rng(1).uniform(0, 300, (20, 20, 20)).astype(np.float32)
    volume = Volume(values, np.ones(3), np.full(3, -9.5))
    quality = Quality(0.5, 0.0, classification=kind)
    camera = Camera.looking_at([0, -30.0, 0], [0, 1.0, 0], extent=0.3, size=(130, 70))
    transfer = TransferFunction(nodes.copy(), color.copy(), kappa.copy())
    wanted = ActiveRayTracer(Scene(volume, transfer), quality).render(camera).rgba
    scene = Scene(volume, TransferFunction(nodes, color, kappa))
    told: list[float] = []

    def edit(share: float) -> bool:
        told.append(share)
        nodes[:], color[:], kappa[:] = [5.0, 7.0], 0.0, 99.0
        return True

    found = ActiveRayTracer(scene, quality, threads=1).render(camera, edit).rgba
    assert len(told) > 1
    assert min(told) < 1
    assert found.tobytes() == wanted.tobytes()
