"""What a cut lays open, and blood: where it is drawn, and that updates follow."""

from dataclasses import fields
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, Change, GBuffer, Material
from renderers.shading import Effects, ScopeLight, ScopeShader, Tier
from renderers.shading.hairs import HairLayer
from renderers.shading.kernels.wound_marks import MOST_SD, SURE_MM
from renderers.shading.materials import material_table
from renderers.shading.noise import noise_tile
from renderers.shading.wounds import WallBlood
from tests.renderers.shading.conftest import CENTRE_MM, trace
from tests.renderers.shading.steel import tool
from tests.renderers.wounded_surface import WoundedSurface

LIGHT = ScopeLight()
TIERS = [Tier.LIVE, Tier.FULL]
PLACE = CENTRE_MM + np.array([-0.7, -4.0, -5.0])
"""On the floor of the tube, in view."""


@pytest.fixture
def patient(surface: AirSurface) -> WoundedSurface:
    return WoundedSurface(surface)


def picture(
    patient: WoundedSurface, camera: Camera, buffer: GBuffer, tier: Tier
) -> NDArray[np.float32]:
    shader = ScopeShader(patient.surface, tier, threads=1)
    return shader.shade(buffer, camera, LIGHT)


def depths(
    patient: WoundedSurface, camera: Camera, buffer: GBuffer
) -> NDArray[np.float64]:
    """Return how deep below the healthy surface pixels are, (h, w) mm."""
    origin, rays = camera.rays()
    depth = np.where(buffer.coverage > 0, buffer.depth_mm, 0)[..., None]
    places = (origin + depth * rays).reshape(-1, 3)
    wounds = patient.surface.wounds
    assert wounds is not None
    below = wounds.pristine.sample(places) - patient.surface.distance.sample(places)
    found: NDArray[np.float64] = below.reshape(buffer.depth_mm.shape)
    return np.where(buffer.coverage > 0, found, 0)


@pytest.mark.parametrize("tier", TIERS)
def test_where_nothing_was_cut_pictures_are_those_without_wounds(
    surface: AirSurface,
    patient: WoundedSurface,
    camera: Camera,
    gbuffer: GBuffer,
    tier: Tier,
) -> None:
    plain = ScopeShader(surface, tier, threads=1)
    wounded = ScopeShader(patient.surface, tier, threads=1)
    for of in (ScopeShader.shade, ScopeShader.reflectance):
        assert_array_equal(
            of(wounded, gbuffer, camera, LIGHT), of(plain, gbuffer, camera, LIGHT)
        )


def test_only_pixels_that_are_cut_or_wet_change(
    surface: AirSurface, patient: WoundedSurface, camera: Camera
) -> None:
    patient.cut(PLACE, 2.0)
    buffer = trace(patient.surface, camera)
    cut = depths(patient, camera, buffer)
    plain = ScopeShader(surface, threads=1).reflectance(buffer, camera, LIGHT)
    shader = ScopeShader(patient.surface, threads=1)
    marked = shader.reflectance(buffer, camera, LIGHT)
    changed = (marked != plain).any(axis=-1)
    assert not changed[cut < 0.015].any()
    assert changed[cut > 0.2].all()
    assert np.count_nonzero(cut > 0.2) > 100
    shader.update(patient.wet(PLACE + np.array([4.0, 0, 1.0]), 3.0, 0.4))
    wet = (shader.reflectance(buffer, camera, LIGHT) != marked).any(axis=-1)
    assert 0 < np.count_nonzero(wet) < wet.size


@pytest.mark.parametrize("tier", TIERS)
def test_injected_mucosa_pales_and_the_rest_keeps_its_bits(
    patient: WoundedSurface, camera: Camera, gbuffer: GBuffer, tier: Tier
) -> None:
    shader = ScopeShader(patient.surface, tier, threads=1)
    before = shader.reflectance(gbuffer, camera, LIGHT)
    shader.update(patient.inject(PLACE, 3.0))
    after = shader.reflectance(gbuffer, camera, LIGHT)
    changed = (after != before).any(axis=-1)
    assert 100 < np.count_nonzero(changed) < 0.7 * changed.size
    # less blood: more light comes back, the more of green for its share
    grown = after[changed].sum(axis=0) / before[changed].sum(axis=0)
    assert 1.0 < grown[0] < grown[1]


def test_instruments_stay_what_they_are(
    surface: AirSurface, patient: WoundedSurface, camera: Camera
) -> None:
    patient.cut(PLACE, 2.0)
    patient.wet(PLACE, 3.0, 0.5)
    buffer = trace(patient.surface, camera)
    buffer.material[:] = Material.METAL
    plain = ScopeShader(surface, threads=1).reflectance(buffer, camera, LIGHT)
    found = ScopeShader(patient.surface, threads=1).reflectance(buffer, camera, LIGHT)
    assert_array_equal(found, plain)


@pytest.mark.parametrize("tier", TIERS)
def test_neither_threads_nor_what_else_is_wanted_change_a_bit(
    patient: WoundedSurface, camera: Camera, tier: Tier
) -> None:
    """All effects, all materials, a tool, wet wounds; deep pixels without mucosa."""
    patient.cut(PLACE, 2.0)
    patient.wet(PLACE, 2.5, 0.5)
    buffer, caster = tool(camera, trace(patient.surface, camera))
    deep = depths(patient, camera, buffer) > SURE_MM + 0.1
    deep &= buffer.material == Material.TISSUE
    assert np.count_nonzero(deep) > 50
    for m in range(7):
        buffer.material[20 + 4 * m : 23 + 4 * m, 25:40] = m
    buffer.coverage[50:54, 40:50] *= 0.5
    effects = Effects(**{field.name: True for field in fields(Effects)})

    def drawn(threads: int, only: NDArray[np.bool_] | None) -> NDArray[np.float32]:
        shader = ScopeShader(patient.surface, tier, threads=threads, effects=effects)
        radiance = shader.shade(buffer, camera, LIGHT, only=only, casters=[caster])
        shader.close()
        return radiance

    whole = drawn(1, None)
    assert np.isfinite(whole).all()
    assert whole.min() >= 0
    for threads in (2, 3):
        assert_array_equal(drawn(threads, None), whole)
    for only in (np.random.default_rng(1).random(buffer.size) < 0.3, deep):
        assert_array_equal(drawn(1, only)[only], whole[only])


def test_no_relief_reaches_as_deep_as_cuts_are_sure() -> None:
    for seed in range(5):
        assert np.abs(noise_tile(4.0, seed)[..., 0]).max() < MOST_SD - 1


Edit = tuple[str, float, float, float]
EDITS = st.lists(
    st.tuples(
        st.sampled_from(["cut", "wet", "redden", "inject", "dry", "heal"]),
        st.floats(-3, 3),
        st.floats(-4, 6),
        st.floats(0.8, 2.5),
    ),
    min_size=1,
    max_size=5,
)


def edited(
    patient: WoundedSurface, kind: str, x: float, y: float, size: float
) -> Change:
    place = PLACE + np.array([x, y, 0.0])
    if kind == "cut":
        return patient.cut(place, size)
    if kind == "wet":
        return patient.wet(place, size, 0.3 * size)
    if kind == "redden":
        return patient.redden(place, size)
    if kind == "inject":
        return patient.inject(place, 2.0 * size)
    return patient.dry() if kind == "dry" else patient.heal()


@pytest.mark.parametrize("tier", TIERS)
@given(edits=EDITS)
@settings(max_examples=4)
def test_an_updated_shader_is_a_new_one(
    surface: AirSurface, camera: Camera, tier: Tier, edits: list[Edit]
) -> None:
    patient = WoundedSurface(surface)
    shader = ScopeShader(patient.surface, tier, threads=1)
    for edit in edits:
        shader.update(edited(patient, *edit))
    buffer = trace(patient.surface, camera)
    found = shader.shade(buffer, camera, LIGHT)
    assert_array_equal(found, picture(patient, camera, buffer, tier))


def test_what_is_undone_is_as_it_was(patient: WoundedSurface, camera: Camera) -> None:
    buffer = trace(patient.surface, camera)
    shader = ScopeShader(patient.surface, Tier.FULL, threads=1)
    before = shader.shade(buffer, camera, LIGHT)
    for change in (patient.cut(PLACE, 2.0), patient.wet(PLACE, 2.0, 0.4)):
        shader.update(change)
    assert not np.array_equal(shader.shade(buffer, camera, LIGHT), before)
    for change in (patient.dry(), patient.heal()):
        shader.update(change)
    assert_array_equal(shader.shade(buffer, camera, LIGHT), before)


def test_walls_that_nobody_cut_keep_their_blood(surface: AirSurface) -> None:
    assert WallBlood(surface).codes is surface.blood.values
    uncut = WallBlood(WoundedSurface(surface).surface)
    assert_array_equal(uncut.codes, surface.blood.values)


def test_depth_tells_flesh_from_bone_and_from_what_lies_beyond(
    surface: AirSurface, camera: Camera
) -> None:
    """A plate of .4 mm, .8 mm deep: redder before it, pale in it, dark behind it.

    Bone without end shows no tissue behind.
    """

    def cut_open(
        patient: WoundedSurface,
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_]]:
        patient.cut(PLACE, 3.2)
        buffer = trace(patient.surface, camera)
        shader = ScopeShader(patient.surface, threads=1)
        green = np.pi * shader.reflectance(buffer, camera, LIGHT)[..., 1]
        return green, depths(patient, camera, buffer), buffer.coverage > 0

    green, cut, seen = cut_open(WoundedSurface(surface))
    healthy = np.median(green[(cut == 0) & seen])
    flesh = np.median(green[(cut > 0.4) & (cut < 0.6)])
    bone = np.median(green[(cut > 0.95) & (cut < 1.05)])
    beyond = np.median(green[(cut > 1.5) & (cut < 2.5)])
    assert beyond < flesh < 0.8 * healthy
    assert bone > 1.2 * healthy
    green, cut, _ = cut_open(WoundedSurface(surface, bone=0, deep=255))
    deep, shallow = green[cut > 1.5], green[(cut > 0.3) & (cut < 0.5)]
    assert np.median(deep) > 1.5 * np.median(shallow)


def test_no_wound_sends_back_more_light_than_it_gets(
    surface: AirSurface, camera: Camera
) -> None:
    patient = WoundedSurface(surface, bone=40, deep=255)
    patient.cut(PLACE, 3.0)
    patient.wet(PLACE, 2.0, 0.3)
    buffer = trace(patient.surface, camera)
    shader = ScopeShader(patient.surface, Tier.FULL, threads=1)
    albedo = np.pi * shader.reflectance(buffer, camera, LIGHT)
    assert albedo.min() >= 0
    assert albedo.max() < 0.95


def test_a_film_takes_light_until_it_is_a_pool(
    surface: AirSurface, camera: Camera
) -> None:
    """Beer and Lambert, twice through; green and blue go before red does."""
    buffer = trace(surface, camera)
    albedo = []
    for thick_mm in (0.0, 0.02, 0.05, 0.2, 2.0):
        patient = WoundedSurface(surface)
        patient.film[:] = round(100 * thick_mm)
        shader = ScopeShader(patient.surface, threads=1)
        found = np.pi * shader.reflectance(buffer, camera, LIGHT)
        albedo.append(found[buffer.coverage > 0])
    for thin, thick in pairwise(albedo):
        assert (thick <= thin + 1e-6).all()
    green = np.median(albedo[1][:, 1]) / np.median(albedo[0][:, 1])
    red = np.median(albedo[1][:, 0]) / np.median(albedo[0][:, 0])
    assert green < 0.6 < red
    row = material_table()[Material.BLOOD]
    pool = (1 - row[4]) * row[2]
    np.testing.assert_allclose(albedo[-1][:, 1], pool, rtol=1e-3)


def test_hairs_fall_with_the_skin_that_they_stand_in(surface: AirSurface) -> None:
    patient = WoundedSurface(surface)
    grown = HairLayer(surface, 7).strands
    layer = HairLayer(patient.surface, 7)
    assert_array_equal(layer.strands.points_mm, grown.points_mm)
    root = grown.points_mm[len(grown.points_mm) // 2, 0]
    layer.update(patient.cut(root, 2.0))
    kept = np.linalg.norm(grown.points_mm[:, 0] - root, axis=1) > 1.0
    assert 0 < len(layer.strands.points_mm) < len(grown.points_mm)
    assert len(layer.strands.points_mm) <= kept.sum()
    for away_mm in (0.0, 3.0, 30.0):
        # near to hairs and far from all of them
        layer.update(patient.cut(root + away_mm * surface.distance.direction[1], 1.0))
        anew = HairLayer(patient.surface, 7)
        assert_array_equal(layer.strands.points_mm, anew.strands.points_mm)
    patient.heal()
    layer.update()
    assert_array_equal(layer.strands.points_mm, grown.points_mm)


def test_relief_keeps_its_place_when_the_scope_moves(
    surface: AirSurface, camera: Camera
) -> None:
    """The same place of a wound has the same colour from two eyes beside each other."""
    patient = WoundedSurface(surface)
    patient.cut(PLACE, 2.5)
    shader = ScopeShader(patient.surface, threads=1)
    buffer = trace(patient.surface, camera)
    moved = Camera.looking_at(
        camera.eye_mm + 1e-4,
        camera.eye_mm + 1e-4 + camera.frame[3],
        extent=camera.extent,
        size=(camera.width, camera.height),
    )
    again = trace(patient.surface, moved)
    a = shader.reflectance(buffer, camera, LIGHT)
    b = shader.reflectance(again, moved, LIGHT)
    cut = depths(patient, camera, buffer) > 0.2
    assert np.median(np.abs(a[cut] - b[cut])) < 2e-3
