"""The emission-absorption integral along one ray against seven closed forms.

A ray of 3 mm runs through a ramp of density that equals its own length, so that a
transfer function is extinction and colour along the way. The midpoint rule with exact
opacities of segments is of second order, exact where both are constant or extinction
is linear, and of first order at a jump, by half a step at the most. Integrated transfer
functions see all of the ramp between samples: extinction is exact at any step, jumps
are, and colour is of second order.
"""

import itertools
import math

import numpy as np
import pytest

from renderers.art import ActiveRayTracer, Quality
from renderers.art.quality import ClassificationName
from renderers.scene import (
    Camera,
    PhongMaterial,
    Projection,
    Scene,
    TransferFunction,
    Volume,
)
from tests.accuracy.known_rays import LENGTH, RAYS, Ray

VOXELS = 48
NODES = 8192
"""Nodes of a transfer function that stands for a curve: its chords are off by 1e-7."""


def scene_along(ray: Ray) -> Scene:
    """Make the ramp and the transfer function of a ray."""
    h = LENGTH / VOXELS
    depth = np.linspace(0, LENGTH, VOXELS + 1, dtype=np.float32)
    values = np.broadcast_to(depth[:, None], (3, VOXELS + 1, 3))
    volume = Volume(
        np.ascontiguousarray(values), np.full(3, h), np.array([-h, 0.0, -h])
    )
    nodes = np.linspace(0, LENGTH, NODES)
    if ray.jump is not None:
        nodes = np.array([0, ray.jump - 1e-7, ray.jump, LENGTH])
    color = np.repeat(ray.color(nodes)[:, None], 3, axis=1)
    transfer = TransferFunction(nodes, color, ray.kappa(nodes))
    return Scene(volume, transfer, (), PhongMaterial(1, 0, 0))


def end_of(
    ray: Ray, steps: int, classification: ClassificationName = "post"
) -> tuple[float, float]:
    """Give the errors of light and transmittance after so many steps."""
    camera = Camera.looking_at(
        [0, -1.0, 0], [0, 1.0, 0], extent=1e-3, size=(1, 1),
        projection=Projection.ORTHOGRAPHIC,
    )  # fmt: skip
    # A hair less than a voxel's part, lest rounding make one step more.
    quality = Quality(VOXELS / steps * (1 + 1e-9), 0.0, classification=classification)
    tracer = ActiveRayTracer(scene_along(ray), quality, threads=1)
    rgba = tracer.render(camera).rgba[0, 0]
    assert tracer.report is not None
    counters = tracer.report.counters
    ends = int(classification == "integrated")
    assert counters["samples"] + counters["skipped"] == steps + ends
    return float(rgba[0]) - ray.light, 1 - float(rgba[3]) - ray.clear


@pytest.mark.parametrize("name", RAYS)
def test_the_closed_forms_are_the_integrals(name: str) -> None:
    """The table above, by Gauss's rule on either side of the jump: ten digits."""
    ray = RAYS[name]
    nodes, weights = np.polynomial.legendre.leggauss(60)
    ends = [0.0, LENGTH] if ray.jump is None else [0.0, ray.jump, LENGTH]
    light, clear = 0.0, 1.0
    for low, high in itertools.pairwise(ends):
        half = (high - low) / 2
        for s, w in zip(low + (nodes + 1) * half, weights, strict=True):
            inner = low + (nodes + 1) * (s - low) / 2
            depth = float(weights @ ray.kappa(inner)) * (s - low) / 2
            here = np.array([s])
            power = float(ray.kappa(here)[0] * ray.color(here)[0])
            light += w * half * power * clear * math.exp(-depth)
        whole = low + (nodes + 1) * half
        clear *= math.exp(-float(weights @ ray.kappa(whole)) * half)
    assert light == pytest.approx(ray.light, rel=1e-10)
    assert clear == pytest.approx(ray.clear, rel=1e-10)


@pytest.mark.parametrize("name", RAYS)
def test_a_fine_step_finds_the_closed_form(name: str) -> None:
    light, clear = end_of(RAYS[name], 512)
    # Second order: 1/1000 of what 16 steps leave. A jump: half a step on the wrong
    # side changes light by .18 and transmittance by .0322 a millimetre.
    most = (0.18, 0.0323) if name == "two layers" else (1e-3, 1e-3)
    assert abs(light) < most[0] * LENGTH / 1024 + 2e-6
    assert abs(clear) < most[1] * LENGTH / 1024 + 2e-6


@pytest.mark.parametrize("name", ["constant", "linear extinction"])
@pytest.mark.parametrize("steps", [16, 17, 40])
def test_what_is_exact_is_exact_in_any_steps(name: str, steps: int) -> None:
    """Opacity is an exponential, and the midpoint's extinction the mean of a line."""
    light, clear = end_of(RAYS[name], steps)
    assert abs(light) < 5e-7
    assert abs(clear) < 5e-7


@pytest.mark.parametrize(
    "name",
    ["exponential extinction", "Gaussian extinction", "linear colour", "cosine colour"],
)
def test_curves_are_met_at_second_order(name: str) -> None:
    """Sixteen to 128 steps; below 1e-6 float32 has its say."""
    errors = np.array([end_of(RAYS[name], n) for n in (16, 32, 64, 128)])
    for column in errors.T:
        size = np.abs(column)
        if size[0] < 1e-5:
            continue
        orders = np.log2(size[:-1] / size[1:])[size[1:] > 1e-6]
        assert orders == pytest.approx(2, abs=0.15)


def test_a_jump_is_met_at_first_order() -> None:
    """At no phase worse than half a step, and at some phase nearly that bad."""
    ray = RAYS["two layers"]
    worst = []
    for steps in (16, 32, 64):
        found = [abs(end_of(ray, steps + k)[0]) * (steps + k) for k in range(12)]
        worst.append(max(found))
    half = LENGTH / 2
    assert max(worst) < 1.05 * 0.1792 * half
    assert min(worst) > 0.3 * 0.1792 * half


@pytest.mark.parametrize(
    "name", [name for name in RAYS if name not in ("linear colour", "cosine colour")]
)
@pytest.mark.parametrize("steps", [13, 16, 40])
def test_integrated_extinction_is_exact_at_any_step(name: str, steps: int) -> None:
    """The ramp is a straight line between samples, too; so are jumps in order."""
    light, clear = end_of(RAYS[name], steps, "integrated")
    # where colour is even, light is opacity
    assert abs(light) < 2e-6
    assert abs(clear) < 2e-6


@pytest.mark.parametrize("name", ["linear colour", "cosine colour"])
def test_integrated_colour_is_met_at_second_order(name: str) -> None:
    """Colour and extinction of many nodes in one step: what hides what is left out."""
    errors = [abs(end_of(RAYS[name], n, "integrated")[0]) for n in (16, 24, 48, 96)]
    orders = np.log(np.array(errors[:-1]) / errors[1:]) / np.log([1.5, 2, 2])
    assert orders == pytest.approx(2, abs=0.15)
