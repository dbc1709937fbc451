"""Splats moved by deflectors look as the ray caster's deformed tissue does."""

import copy

import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy import Phantom, PhantomParameters, build_phantom
from benchmarks.deflected_turbinate import (
    DEFORMATIONS,
    VIEWS,
    turbinate_camera,
    turbinate_picture,
    turbinate_scene,
)
from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer
from renderers.fsr.deformation import SEAM_MM
from renderers.scene import (
    AirSurface,
    Camera,
    GBuffer,
    Mesh,
    Scene,
    TransferFunction,
    Volume,
    rmse_codes,
    ssim,
)
from renderers.scene.deflection import Cut, Deflection, deflected_scene
from renderers.shading import Caster, Tier
from scenarios.instruments import suction_tube

SPACING_MM = 0.7


@pytest.fixture(scope="module")
def phantom() -> Phantom:
    box = ((-32.0, 12.0), (-6.0, 60.0), (-4.0, 56.0))
    return build_phantom(PhantomParameters(), SPACING_MM, field_mm=box)


def turbinate_tool(view: str) -> NDArray[np.float64]:
    """Place a suction tube ``(4, 4)`` beside the lens, its tip before the turbinate."""
    eye, target, _ = VIEWS[view]
    right, up, forward = turbinate_camera(view).frame[1:]
    tip = eye + 0.75 * (target - eye) + 0.8 * right
    back = eye - 3.0 * forward + 2.5 * (right - up) - tip
    back /= np.linalg.norm(back)
    across = np.cross(up, back)
    across /= np.linalg.norm(across)
    pose = np.eye(4)
    pose[:3] = np.stack([across, np.cross(back, across), back, tip], axis=1)
    return pose


def with_tool(buffer: GBuffer, view: str, tool: Mesh) -> GBuffer:
    result = copy.deepcopy(buffer)
    tool.draw(result, turbinate_camera(view), turbinate_tool(view))
    return result


@pytest.mark.slow
@pytest.mark.parametrize("name", list(DEFORMATIONS))
def test_displaced_splats_show_what_bent_rays_see(phantom: Phantom, name: str) -> None:
    """The same maps, one asked by rays, the other inverted for splats.

    In both tiers, without and with a tool: SSIM .988 to .999 and .4 to 2.7 codes were
    measured with cuts, .978 and 3.9 at worst where tissue is shrunk and seen near.
    """
    scene = turbinate_scene(phantom)
    deflection = DEFORMATIONS[name]
    # what light falls on is read from the deformed tissue for both
    deformed = deflected_scene(scene, deflection)
    splats = FuzzySetRenderer(scene, deflection=deflection)
    rays = ActiveRayTracer(scene, deflection=deflection)
    straight = ActiveRayTracer(scene)
    tool, alike = suction_tube(), []
    for view in VIEWS:
        camera = turbinate_camera(view)
        met, found = rays.gbuffer(camera), splats.gbuffer(camera)
        assert rays.report is not None
        assert rays.report.counters["deflected"] > 0
        assert np.all(found.coverage[met.coverage > 0] == 1), f"holes seen from {view}"
        wanted, gain = turbinate_picture(deformed, met, None, view)
        still, _ = turbinate_picture(scene, straight.gbuffer(camera), gain, view)
        assert rmse_codes(still, wanted) > 11, "it moves"
        shadow = [Caster.of(tool, turbinate_tool(view))]
        for tier in (Tier.LIVE, Tier.FULL):
            for casters in ([], shadow):
                if casters:
                    seen = [with_tool(each, view, tool) for each in (met, found)]
                else:
                    seen = [met, found]
                by_rays, gain = turbinate_picture(
                    deformed, seen[0], None, view, tier, casters
                )
                by_splats, _ = turbinate_picture(
                    deformed, seen[1], gain, view, tier, casters
                )
                alike.append(ssim(by_splats, by_rays))
                codes = rmse_codes(by_splats, by_rays)
                about = f"{view}, {tier.name}, tool: {len(casters)}"
                print(f"{name}: {about}: SSIM {alike[-1]:.4f}, {codes:.2f} codes")
                assert alike[-1] >= 0.97, about
                assert codes <= 5.0, about
    splats.close()
    assert np.mean(alike) >= 0.985


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in DEFORMATIONS if "cut" not in name])
def test_deformed_tissue_looks_the_same_by_splats_and_by_rays(
    phantom: Phantom, name: str
) -> None:
    """Rays that know no deflectors, through the deformed tissue on its own grid.

    A grid of .7 mm rounds a cut's rims: rays through it are 12 to 18 codes from bent
    ones, so that with a cut it is no judge.
    """
    scene = turbinate_scene(phantom)
    deflection = DEFORMATIONS[name]
    deformed = deflected_scene(scene, deflection)
    splats = FuzzySetRenderer(scene, deflection=deflection)
    camera = turbinate_camera()
    found = splats.gbuffer(camera)
    met = ActiveRayTracer(deformed).gbuffer(camera)
    wanted, gain = turbinate_picture(deformed, met, None)
    picture, _ = turbinate_picture(deformed, found, gain)
    unmoved = ActiveRayTracer(scene).gbuffer(camera)
    still, _ = turbinate_picture(scene, unmoved, gain)
    splats.close()
    assert rmse_codes(still, wanted) > 11, "it moves"
    assert ssim(picture, wanted) >= 0.95
    assert rmse_codes(picture, wanted) <= 11.0
    assert np.all(found.coverage[met.coverage > 0] == 1), "no hole pixels"


def hollow_scene() -> Scene:
    """Air inside a sphere of 6 mm, 0.5 mm voxels."""
    k, j, i = np.indices((33, 33, 33)) * 0.5 - 8.0
    depth = (np.sqrt(i * i + j * j + k * k) - 6.0).astype(np.float32)
    distance = Volume(depth, np.full(3, 0.5), np.full(3, -8.0))
    codes = distance.with_values(np.zeros(distance.shape, np.uint8), 0.0)
    nothing = TransferFunction(np.array([0.0, 1.0]), np.zeros((2, 3)), np.zeros(2))
    return Scene(distance, nothing, surface=AirSurface(distance, codes, codes))


@pytest.mark.parametrize("by", [FuzzySetRenderer, ActiveRayTracer])
def test_nobody_looks_through_a_thin_leaf_that_a_cut_leaves(
    by: type[FuzzySetRenderer] | type[ActiveRayTracer],
) -> None:
    """It is on no grid of whole voxels, and may lie between two steps."""
    scene = hollow_scene()
    assert scene.surface is not None
    distance = scene.surface.distance
    cut = Cut(np.array([5.75, 0.0, 0.0]), 4.0, np.array([1.0, 0.0, 0.0]), 1.2)
    deflection = Deflection((cut,))
    camera = Camera.looking_at((0, 0, 0), (6, 0, 0), size=(90, 90), extent=0.5)
    found = by(scene, deflection=deflection).gbuffer(camera)

    def inside(x: NDArray[np.float64]) -> NDArray[np.float64]:
        seen = distance.sample(deflection.pull_back(x))
        return np.asarray(np.minimum(seen, deflection.opening(x)))

    eye, ways = (part.reshape(-1, 3) for part in camera.rays())
    steps = np.arange(3.0, 8.0, 0.02)
    tissue = np.stack([inside(eye + depth * ways) >= 0 for depth in steps])
    # a tenth of a millimetre deep, as the ray goes: rims end in nothing
    deep = np.lib.stride_tricks.sliding_window_view(tissue, 6, axis=0).all(axis=-1)
    first = np.where(deep.any(axis=0), steps[np.argmax(deep, axis=0)], np.inf)
    seen = found.coverage.reshape(-1) > 0
    place = eye + np.where(seen & np.isfinite(first), first, 0)[:, None] * ways
    leaf = seen & (deflection.opening(place) < SEAM_MM)
    assert leaf.sum() > 500
    assert not (found.depth_mm.reshape(-1)[leaf] > first[leaf] + 0.01).any()
