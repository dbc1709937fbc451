"""Light at half the size: what it must give back, and where it must not spread."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, GBuffer, Material, ssim
from renderers.shading import (
    CameraPass,
    CameraSettings,
    ScopeLight,
    ScopeShader,
    Tier,
)
from renderers.shading.bands import RowBands
from renderers.shading.half_light import HALF_FROM_PX, half_lit, may_be_halved
from tests.renderers.shading.conftest import CENTRE_MM, make_camera, trace
from tests.renderers.shading.steel import tool
from tests.renderers.wounded_surface import WoundedSurface

LIGHT = ScopeLight()
SIZE = 64
ALONG = np.array([0.3, -1.7, 0.4], np.float32)


def wall(depth_mm: float = 20.0) -> GBuffer:
    """A wall that fills the picture."""
    buffer = GBuffer.empty(SIZE, SIZE)
    buffer.depth_mm[:], buffer.coverage[:] = depth_mm, 1
    buffer.normal[..., 2] = -1
    return buffer


def places(size: int) -> NDArray[np.float64]:
    """Where pixels of a picture are, ``(size, size, 2)``, the picture being 0..1."""
    at = (np.arange(size) + 0.5) / size
    return np.stack(np.meshgrid(at, at), axis=-1)


def law(at: NDArray[np.float64]) -> NDArray[np.float32]:
    x, y = np.moveaxis(at, -1, 0)
    value = 1 + x + 0.5 * y + 2 * x * y - x * x + 0.3 * y * y
    colours = value[..., None] * np.array([1.0, 2.0, 0.5])
    found: NDArray[np.float32] = colours.astype(np.float32)
    return found


def lit(
    buffer: GBuffer, colours: NDArray[np.float32], threads: int = 1
) -> NDArray[np.float32]:
    """Light a picture by a function that gives each half-sized pixel its colour."""
    camera = make_camera(SIZE, SIZE)

    def paint(half: GBuffer, small: Camera) -> NDArray[np.float32]:
        assert (small.height, small.width) == half.size == colours.shape[:2]
        return colours * half.coverage[..., None]

    return half_lit(buffer.read_only(), camera, paint, RowBands(threads))


def test_what_bends_as_a_parabola_is_given_back() -> None:
    """The cubic's order; near the edge of the picture it has no neighbours."""
    found = lit(wall(), law(places(SIZE // 2)))
    inside = slice(4, -4), slice(4, -4)
    assert_allclose(found[inside], law(places(SIZE))[inside], rtol=1e-5)


def test_nothing_spreads_over_the_edge_of_a_piece() -> None:
    for edge in (31, 32):
        buffer = wall()
        buffer.depth_mm[:, edge:] = 40.0
        colours = np.zeros((SIZE // 2, SIZE // 2, 3), np.float32)
        colours[:, (edge + 1) // 2 :] = 1
        found = lit(buffer, colours)
        assert np.all(found[:, :edge] < 1e-3)
        assert np.all(found[:, edge:] > 0.999)


@pytest.mark.parametrize("wide", [2, 3, 7])
def test_a_tool_has_its_own_light_up_to_its_edge(wide: int) -> None:
    buffer = wall()
    buffer.material[:, 21 : 21 + wide] = Material.METAL
    shown = buffer.material[::2, ::2]
    colours = np.where(shown[..., None] == Material.METAL, 5.0, 1.0)
    found = lit(buffer, np.broadcast_to(colours, (*shown.shape, 3)).astype(np.float32))
    assert_allclose(found[buffer.material == Material.METAL], 5.0, rtol=1e-6)
    assert_allclose(found[buffer.material == Material.TISSUE], 1.0, rtol=1e-6)


def test_what_is_covered_in_part_shines_in_part() -> None:
    buffer = wall()
    buffer.coverage[20:30] = 0.5
    buffer.coverage[40:], buffer.depth_mm[40:] = 0, np.inf
    found = lit(buffer, np.ones((SIZE // 2, SIZE // 2, 3), np.float32))
    assert_allclose(found[:20], 1.0, rtol=1e-6)
    assert_allclose(found[20:30], 0.5, rtol=1e-6)
    assert not found[40:].any()


def test_any_number_of_threads_gives_the_same_bits() -> None:
    rng = np.random.default_rng(3)
    buffer = wall()
    buffer.depth_mm[:] *= rng.uniform(0.97, 1.03, buffer.size).astype(np.float32)
    buffer.coverage[rng.random(buffer.size) < 0.05] = 0
    colours = rng.random((SIZE // 2, SIZE // 2, 3)).astype(np.float32)
    assert_array_equal(lit(buffer, colours, 3), lit(buffer, colours))


def test_only_large_even_pictures_are_halved() -> None:
    assert may_be_halved((HALF_FROM_PX, HALF_FROM_PX + 2))
    for size in ((HALF_FROM_PX - 2, 2048), (801, 800), (800, 801)):
        assert not may_be_halved(size)


def test_what_is_asked_for_in_part_is_lit_in_full(surface: AirSurface) -> None:
    camera = make_camera(640, 640)
    buffer = trace(surface, camera)
    full, half = (ScopeShader(surface, tier) for tier in (Tier.LIVE, Tier.FLIGHT))
    wanted = np.zeros(buffer.size, np.bool_)
    wanted[200:260, 100:180] = True
    part = half.shade(buffer, camera, LIGHT, only=wanted)
    whole = full.shade(buffer, camera, LIGHT)
    assert_array_equal(part[wanted], whole[wanted])
    small = make_camera(72, 64)
    buffer = trace(surface, small)
    assert_array_equal(
        half.shade(buffer, small, LIGHT), full.shade(buffer, small, LIGHT)
    )


def test_a_wound_and_a_tool_look_as_in_full_light(surface: AirSurface) -> None:
    patient = WoundedSurface(surface)
    place = CENTRE_MM + np.array([-0.7, -4.0, -5.0])
    patient.cut(place, 2.0)
    patient.wet(place, 3.0, 0.5)
    camera = make_camera(640, 640)
    buffer = trace(patient.surface, camera)
    buffer, caster = tool(camera, buffer)
    finish, pictures, gain = CameraPass(CameraSettings(noise=0)), [], None
    for tier in (Tier.LIVE, Tier.FLIGHT):
        shader = ScopeShader(patient.surface, tier)
        radiance = shader.shade(buffer, camera, LIGHT, casters=[caster])
        picture, gain = finish.finish(radiance, buffer, camera, gain=gain)
        pictures.append(picture)
    assert ssim(*pictures) >= 0.98
    assert np.any(pictures[0] != pictures[1])
