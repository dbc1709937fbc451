"""A lost wall is never shown as sure: proved for flat ones, counted in a nose."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from anatomy import PhantomParameters, build_phantom
from renderers.art import ActiveRayTracer
from renderers.art.wall_confidence import wall_confidence
from renderers.scene import AirSurface, Camera, Projection, Scene, Volume
from renderers.scene.transfer import TransferFunction

N = 25


def scene_of(distance: Volume) -> Scene:
    tint = distance.with_values(np.zeros(distance.shape, np.uint8), 0.0)
    nothing = TransferFunction(np.array([0.0, 1.0]), np.zeros((2, 3)), np.zeros(2))
    return Scene(distance, nothing, surface=AirSurface(distance, tint, tint))


def plate(
    normal: NDArray[Any], shift: float, thickness: float, spacing: NDArray[Any]
) -> Volume:
    """Sample a flat wall's exact distance about the middle of a box."""
    axes = [(np.arange(N) - (N - 1) / 2) * s for s in spacing]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    u = normal[0] * x + normal[1] * y + normal[2] * z - shift
    values = (thickness / 2 - np.abs(u)).astype(np.float32)
    origin = np.array([axis[0] for axis in axes])
    return Volume(values, spacing, origin, np.eye(3), 1.0)


def across(normal: NDArray[Any], way: float = 4.0) -> Camera:
    """Look straight at the wall through parallel rays."""
    up = np.eye(3)[int(np.argmin(np.abs(normal)))]
    return Camera.looking_at(
        -way * normal,
        normal,
        up=up,
        extent=1.5,
        size=(24, 24),
        projection=Projection.ORTHOGRAPHIC,
    )


@settings(max_examples=40)
@given(
    st.floats(-1, 1),
    st.floats(0, 2 * math.pi),
    st.floats(-0.5, 0.5),
    st.floats(0.05, 2.0),
    st.sampled_from([(1.0, 1.0, 1.0), (0.6, 0.8, 1.0)]),
)
def test_a_flat_wall_is_drawn_or_doubted(
    z: float,
    turn: float,
    shift: float,
    thickness: float,
    spacing: tuple[float, float, float],
) -> None:
    """In any direction and place: sure pixels are right, thick walls always there."""
    r = math.sqrt(1 - z * z)
    normal = np.array([r * math.cos(turn), r * math.sin(turn), z])
    distance = plate(normal, shift, thickness, np.array(spacing))
    camera = across(normal)
    depth = ActiveRayTracer(scene_of(distance), threads=1).gbuffer(camera).depth_mm
    rating = wall_confidence(distance, camera, depth, threads=1)
    lost = np.isinf(depth)
    if thickness >= 1.01:
        assert not lost.any()
    if thickness <= 0.98:
        assert (rating < 1).all(), "also where it shows, it may have holes"
    assert (rating[lost] < 1).all()


def test_air_without_walls_and_a_thick_wall_are_sure() -> None:
    normal = np.array([0.0, 0.0, 1.0])
    thick = plate(normal, 0.2, 4.0, np.ones(3))
    camera = across(normal, 9.0)
    depth = ActiveRayTracer(scene_of(thick)).gbuffer(camera).depth_mm
    assert (wall_confidence(thick, camera, depth) == 1).all()
    air = thick.with_values(np.full(thick.shape, -9, np.float32), 1.0)
    nothing = np.full(depth.shape, np.inf, np.float32)
    assert (wall_confidence(air, camera, nothing) == 1).all()


def test_the_rating_is_the_thickness_over_the_spacing() -> None:
    normal = np.array([0.0, 0.0, 1.0])
    camera = across(normal)
    # samples lie in the wall's middle: its interpolated distance is exact
    for thickness in (0.3, 0.5, 0.8):
        distance = plate(normal, 0.0, thickness, np.ones(3))
        depth = ActiveRayTracer(scene_of(distance)).gbuffer(camera).depth_mm
        rating = wall_confidence(distance, camera, depth)
        assert rating == pytest.approx(thickness, abs=2 / 16)


def test_threads_do_not_change_a_bit_and_sizes_must_fit() -> None:
    normal = np.array([0.6, 0.0, 0.8])
    distance = plate(normal, 0.3, 0.7, np.ones(3))
    camera = across(normal)
    depth = ActiveRayTracer(scene_of(distance)).gbuffer(camera).depth_mm
    alone = wall_confidence(distance, camera, depth, threads=1)
    assert_array_equal(wall_confidence(distance, camera, depth, threads=3), alone)
    with pytest.raises(ValueError, match=r"depth of \(24, 5\) does not fit"):
        wall_confidence(distance, camera, depth[:, :5])


@pytest.mark.slow
def test_walls_that_a_coarse_nose_lacks_are_doubted() -> None:
    """A nose at 1 mm against itself at .4: of what is hidden, next to nothing is sure.

    Views among the ethmoid cells, whose septa are thinner than a millimetre.
    """
    box = ((-34.0, -2.0), (-2.0, 44.0), (14.0, 52.0))
    fine, coarse = (
        build_phantom(PhantomParameters(), spacing, field_mm=box)
        for spacing in (0.4, 1.0)
    )
    surfaces = [scene_of(p.distance) for p in (fine, coarse)]
    missed = sure = hidden = pixels = 0
    deep = np.argwhere(coarse.distance.values < -1.2)[::400]
    matrix = coarse.distance.world_from_voxel
    tracers = [ActiveRayTracer(scene) for scene in surfaces]
    for k, j, i in deep[:60]:
        eye = matrix[:3, :3] @ np.array([i, j, k]) + matrix[:3, 3]
        middle = np.array([-16.0, 20.0, 34.0])
        camera = Camera.looking_at(eye, middle, extent=0.7, size=(64, 64))
        true, found = (tracer.gbuffer(camera).depth_mm for tracer in tracers)
        rating = wall_confidence(coarse.distance, camera, found)
        behind = found > true + 1.5
        seen = np.linalg.norm(camera.lens_table(), axis=-1) > 0.5
        hidden += int(behind.sum())
        missed += int((behind & (rating == 1)).sum())
        sure += int((rating[seen] == 1).sum())
        pixels += int(seen.sum())
    print(hidden, missed, sure, pixels)
    assert hidden > 300
    # the proof is for flat walls; 3.6 % was measured
    assert missed <= 0.05 * hidden
    assert sure > 0.4 * pixels
