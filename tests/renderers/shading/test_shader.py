from dataclasses import fields, replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, GBuffer, Material, Projection
from renderers.shading import Caster, Effects, ScopeLight, ScopeShader, Tier
from renderers.shading.path_tracer import PathLight
from tests.renderers.shading.steel import tool

LIGHT = ScopeLight()
ONE_SHOT = [Tier.LIVE, Tier.FULL]


@pytest.fixture(scope="module")
def shaders(surface: AirSurface) -> dict[Tier, ScopeShader]:
    return {tier: ScopeShader(surface, tier, threads=1) for tier in ONE_SHOT}


@pytest.mark.parametrize("tier", ONE_SHOT)
def test_light_is_a_factor_and_falls_on_what_is_covered_alone(
    camera: Camera, gbuffer: GBuffer, shaders: dict[Tier, ScopeShader], tier: Tier
) -> None:
    """The G-buffer is only read."""
    before = {f.name: getattr(gbuffer, f.name).copy() for f in fields(gbuffer)}
    once = shaders[tier].shade(gbuffer, camera, LIGHT)
    twice = shaders[tier].shade(gbuffer, camera, ScopeLight(power=2.0))
    assert_array_equal(twice, 2 * once)
    assert np.all(once[gbuffer.coverage == 0] == 0)
    assert np.all(once[gbuffer.coverage > 0] > 0)
    empty = GBuffer.empty(camera.height, camera.width)
    assert not shaders[tier].shade(empty, camera, LIGHT).any()
    for name, array in before.items():
        assert_array_equal(getattr(gbuffer, name), array)


@pytest.mark.parametrize("tier", ONE_SHOT)
def test_extreme_geometry_stays_finite(
    camera: Camera, shaders: dict[Tier, ScopeShader], tier: Tier
) -> None:
    _, rays = camera.rays()
    buffer = GBuffer.empty(camera.height, camera.width)
    seen = np.linalg.norm(rays, axis=-1) > 0.5
    seen[:, ::7] = False
    buffer.depth_mm[seen] = np.geomspace(1e-6, 500, int(seen.sum()))
    grazing = np.cross(rays, camera.frame[2])
    grazing /= np.maximum(np.linalg.norm(grazing, axis=-1, keepdims=True), 1e-9)
    buffer.normal[seen] = grazing[seen]
    buffer.normal[::3] = -rays[::3]
    buffer.normal[1::3] = rays[1::3]  # turned away: must not happen, must not break
    buffer.coverage[seen] = 1
    buffer.material[:] = np.arange(camera.width) % len(Material)
    radiance = shaders[tier].shade(buffer, camera, LIGHT)
    assert np.all(np.isfinite(radiance))
    assert np.all(radiance >= 0)
    assert not radiance[~seen].any()


def test_coverage_multiplies(
    camera: Camera, tissue_gbuffer: GBuffer, shaders: dict[Tier, ScopeShader]
) -> None:
    full = shaders[Tier.LIVE].shade(tissue_gbuffer, camera, LIGHT)
    half = GBuffer(
        tissue_gbuffer.depth_mm,
        tissue_gbuffer.normal,
        tissue_gbuffer.coverage * np.float32(0.5),
        tissue_gbuffer.material,
    )
    assert_array_equal(shaders[Tier.LIVE].shade(half, camera, LIGHT), full / 2)


def test_a_grid_turned_against_the_world_shades_alike(
    surface: AirSurface,
    turned_surface: AirSurface,
    camera: Camera,
    tissue_gbuffer: GBuffer,
) -> None:
    # hairs are drawn by lot among voxels, and mirrored rays end with the grid
    effects = Effects.none()
    a, b = (
        ScopeShader(s, Tier.FULL, threads=1, effects=effects).shade(
            tissue_gbuffer, camera, LIGHT
        )
        for s in (surface, turned_surface)
    )
    # the same blood on another lattice: interpolation and 8-bit codes differ a little
    np.testing.assert_allclose(b, a, rtol=0.15, atol=2e-3 * float(a.max()))
    assert float(np.abs(b - a).mean()) < 0.01 * float(a.mean())


def test_more_blood_is_redder_and_darker(
    surface: AirSurface, camera: Camera, tissue_gbuffer: GBuffer
) -> None:
    pale, normal, inflamed = (
        ScopeShader(surface, blood_bias=bias, threads=1)
        .shade(tissue_gbuffer, camera, LIGHT)
        .mean(axis=(0, 1))
        for bias in (0.4, 1.0, 1.9)
    )
    assert pale[0] / pale[1] < normal[0] / normal[1] < inflamed[0] / inflamed[1]
    assert np.all(pale > normal)
    assert np.all(normal > inflamed)


def test_the_seed_moves_the_detail_only(
    surface: AirSurface, camera: Camera, tissue_gbuffer: GBuffer
) -> None:
    a, b = (
        ScopeShader(surface, Tier.FULL, seed, threads=1).shade(
            tissue_gbuffer, camera, LIGHT
        )
        for seed in (1, 2)
    )
    assert not np.array_equal(a, b)
    np.testing.assert_allclose(a.mean(axis=(0, 1)), b.mean(axis=(0, 1)), rtol=0.15)


def test_what_does_not_fit_is_refused(
    surface: AirSurface,
    camera: Camera,
    gbuffer: GBuffer,
    shaders: dict[Tier, ScopeShader],
) -> None:
    shader = shaders[Tier.LIVE]
    with pytest.raises(ValueError, match="does not fit a camera"):
        shader.shade(GBuffer.empty(8, 8), camera, LIGHT)
    flat = Camera(
        camera.frame, 10.0, camera.width, camera.height, Projection.ORTHOGRAPHIC
    )
    with pytest.raises(ValueError, match="orthographic"):
        shader.shade(gbuffer, flat, LIGHT)
    with pytest.raises(ValueError, match=r"blood bias.*-1"):
        ScopeShader(surface, blood_bias=-1)


def other_light(gbuffer: GBuffer, irradiance: float) -> PathLight:
    light = np.full((*gbuffer.size, 3), irradiance, np.float32)
    return PathLight(light, np.zeros_like(light), 16)


def test_light_found_elsewhere_takes_the_place_of_the_quick_bounce(
    camera: Camera, gbuffer: GBuffer, shaders: dict[Tier, ScopeShader]
) -> None:
    shader = shaders[Tier.FULL]
    dark = shader.shade(gbuffer, camera, LIGHT, other_light(gbuffer, 0))
    lit = shader.shade(gbuffer, camera, LIGHT, other_light(gbuffer, 0.5))
    twice = shader.shade(gbuffer, camera, LIGHT, other_light(gbuffer, 1.0))
    seen = gbuffer.coverage > 0
    quick = shader.shade(gbuffer, camera, LIGHT)
    assert np.all(dark[seen] <= quick[seen])
    assert np.any(dark[seen] < quick[seen])
    np.testing.assert_allclose(twice - dark, 2 * (lit - dark), rtol=1e-3, atol=1e-6)
    # a metal of albedo .04 mirrors .55 before light comes to it
    metal = seen & (gbuffer.material == Material.METAL)
    returned = (twice - dark)[metal] / gbuffer.coverage[metal][:, None]
    np.testing.assert_allclose(returned, 0.45 * 0.04 / np.pi, rtol=1e-3)
    assert not (twice - dark)[~seen].any()


def test_light_of_another_size_is_refused(
    camera: Camera, gbuffer: GBuffer, shaders: dict[Tier, ScopeShader]
) -> None:
    light = other_light(GBuffer.empty(8, 8), 1)
    with pytest.raises(ValueError, match=r"light of \(8, 8, 3\) does not fit"):
        shaders[Tier.FULL].shade(gbuffer, camera, LIGHT, light)


def all_skin(surface: AirSurface) -> AirSurface:
    """The same tube, its skin as far in as it goes."""
    skin = surface.skin.with_values(np.full(surface.distance.shape, 255, np.uint8), 0)
    return AirSurface(surface.distance, surface.blood, skin)


def shade_with(
    surface: AirSurface,
    camera: Camera,
    buffer: GBuffer,
    casters: tuple[Caster, ...],
    tier: Tier,
    **effects: bool,
) -> NDArray[np.float32]:
    wanted = replace(Effects.none(), **effects)
    shader = ScopeShader(surface, tier, threads=1, effects=wanted)
    radiance = shader.shade(buffer, camera, LIGHT, casters=casters)
    shader.close()
    return radiance


def test_a_tool_only_takes_light_from_tissue(
    surface: AirSurface, camera: Camera, tissue_gbuffer: GBuffer
) -> None:
    seen, caster = tool(camera, tissue_gbuffer)
    metal = seen.material == Material.METAL
    assert 40 < metal.sum() < metal.size / 4
    dark = {}
    for tier in ONE_SHOT:
        bare = shade_with(surface, camera, seen, (), tier)
        shadowed = shade_with(surface, camera, seen, (caster,), tier, tool_shadow=True)
        assert np.all(shadowed[~metal] <= bare[~metal] * np.float32(1.00001))
        dark[tier] = 1 - shadowed[~metal].sum(axis=-1) / np.maximum(
            bare[~metal].sum(axis=-1), 1e-9
        )
        # a shadow that is seen: some of the tissue loses half of its light
        assert np.percentile(dark[tier], 99.5) > 0.4
        off = shade_with(surface, camera, seen, (caster,), tier)
        assert_array_equal(off, bare)
    # two lines of light and six make one shadow
    assert np.abs(dark[Tier.LIVE] - dark[Tier.FULL]).mean() < 0.01
    assert np.percentile(np.abs(dark[Tier.LIVE] - dark[Tier.FULL]), 99) < 0.15


@pytest.mark.parametrize("tier", ONE_SHOT)
def test_each_effect_changes_what_it_names_and_nothing_else(
    surface: AirSurface, camera: Camera, tissue_gbuffer: GBuffer, tier: Tier
) -> None:
    seen, caster = tool(camera, tissue_gbuffer)
    metal = seen.material == Material.METAL
    surface = all_skin(surface)
    none = shade_with(surface, camera, seen, (caster,), tier)
    for name in (field.name for field in fields(Effects)):
        found = shade_with(surface, camera, seen, (caster,), tier, **{name: True})
        changed = np.any(found != none, axis=-1)
        assert changed.any() or name == "thin_walls", name
        if name == "metal_mirror":
            assert not changed[~metal].any()
            assert np.all(found >= none)
        if name == "film_mirror":
            assert not changed[metal].any()
            assert np.all(found >= none)


def test_hairs_are_no_part_of_the_depth_and_may_be_switched_off(
    surface: AirSurface, camera: Camera, tissue_gbuffer: GBuffer
) -> None:
    depth = tissue_gbuffer.depth_mm.copy()
    skin = all_skin(surface)
    bare = shade_with(skin, camera, tissue_gbuffer, (), Tier.LIVE)
    hairy = shade_with(skin, camera, tissue_gbuffer, (), Tier.LIVE, hairs=True)
    assert_array_equal(tissue_gbuffer.depth_mm, depth)
    changed = np.any(hairy != bare, axis=-1)
    assert 0 < changed.mean() < 0.3
    # dark, though one that stands near the fibres may outshine the wall behind it
    changed &= tissue_gbuffer.coverage > 0
    assert np.median(hairy[changed] / bare[changed]) < 0.95
