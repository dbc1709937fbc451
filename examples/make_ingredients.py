"""Make ``docs/pictures/ingredients.png``: what each part of the light costs and does.

    python examples/make_ingredients.py

Each pair shows a view without and with one ingredient, all others as in a snapshot, by
one exposure. Below it: the processor's time it adds to a picture of 512 x 512 with four
samples a pixel, in a hundredth of that picture's, and the root mean square difference
in codes of 255.
"""

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from benchmarks.nasal_views import (
    NasalView,
    acceptance_views,
    bundled_flight,
    nasal_scene,
)
from paravol.patient import load_patient
from paravol.session_setup import first_views
from renderers.art import ActiveRayTracer
from renderers.scene import Camera, GBuffer, rmse_codes, save_png
from renderers.shading import (
    CameraPass,
    Caster,
    ScopeLight,
    ScopeShader,
    Tier,
    downsample_gbuffer,
    downsample_radiance,
)
from renderers.shading.illumination import Effects
from renderers.shading.path_tracer import PathLight
from scenarios.instruments import suction_tube

SIZE = 512
PANEL = 220
BAND_PX = 40
COLUMNS = 2
Pixels = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Sitting:
    """Hold a view with what rays found in it, four samples a pixel."""

    camera: Camera
    light: ScopeLight
    head: str
    gbuffer: GBuffer
    casters: tuple[Caster, ...] = ()


def main() -> None:
    """Draw the pairs and put them on one sheet."""
    views = {view.name: view for view in acceptance_views(SIZE)}
    tool = with_tool()
    everything = Tier.SNAPSHOT.effects
    pairs = [
        pair("shadow of the tool", tool, replace(everything, tool_shadow=False)),
        pair("walls in metal", tool, replace(everything, metal_mirror=False)),
        pair("hairs", sitting(views["vestibule"]), replace(everything, hairs=False)),
        pair(
            "walls in the wet film",
            sitting(views["choana"]),
            replace(everything, film_mirror=False),
        ),
        pair(
            "light through thin walls",
            sitting(views["recess"]),
            replace(everything, thin_walls=False),
        ),
        pair("light from wall to wall", sitting(views["middle meatus"]), None),
    ]
    rows = -(-len(pairs) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * (2 * PANEL + 12), rows * (PANEL + BAND_PX)))
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=13)
    for number, (caption, left, right) in enumerate(pairs):
        x = number % COLUMNS * (2 * PANEL + 12)
        y = number // COLUMNS * (PANEL + BAND_PX)
        for offset, pixels in ((0, left), (PANEL, right)):
            small = Image.fromarray(pixels).resize((PANEL, PANEL), Image.Resampling.BOX)
            sheet.paste(small, (x + offset, y))
        draw.text((x + 6, y + PANEL + 8), caption, fill=(230, 230, 230), font=font)
        print(caption)
    out = Path(__file__).parents[1] / "docs" / "pictures" / "ingredients.png"
    save_png(out, np.asarray(sheet))


def sitting(view: NasalView) -> Sitting:
    """Trace a view."""
    fine = view.camera.with_size(2 * SIZE, 2 * SIZE)
    found = ActiveRayTracer(nasal_scene(view.head), threads=1).gbuffer(fine)
    return Sitting(view.camera, view.light, view.head, found)


def with_tool() -> Sitting:
    """Trace a place of the bundled flight with the suction tube before the lens."""
    scenario, path = bundled_flight()
    patient = load_patient(scenario, lambda stage, share: None)
    *_, seen = first_views(scenario, patient, path, (SIZE, SIZE))
    fine = seen.camera.with_size(2 * SIZE, 2 * SIZE)
    found = ActiveRayTracer(nasal_scene("default"), threads=1).gbuffer(fine)
    tube = suction_tube()
    tube.draw(found, fine, seen.world_from_instrument)
    light = ScopeLight(scenario.scope.ring_radius_mm)
    casters = (Caster.of(tube, seen.world_from_instrument),)
    return Sitting(seen.camera, light, "default", found, casters)


def pair(name: str, of: Sitting, without: Effects | None) -> tuple[str, Pixels, Pixels]:
    """Draw without and with; without=None leaves the bounced light out."""
    everything = Tier.SNAPSHOT.effects
    full, gain, cost = drawn(of, everything, None, dark=False)
    less, _, saved = drawn(of, without or everything, gain, dark=without is None)
    extra = bounce_cost(of) if without is None else cost - saved
    share = 100 * max(extra, 0.0) / cost
    codes = rmse_codes(less, full)
    return f"{name}: {share:.0f} % of the time, {codes:.1f} codes", less, full


def bounce_cost(of: Sitting) -> float:
    """Time what finds the light from wall to wall, the least of three."""
    surface = nasal_scene(of.head).surface
    assert surface is not None
    shader = ScopeShader(surface, Tier.SNAPSHOT, threads=1, effects=Effects.none())
    fine = of.camera.with_size(2 * SIZE, 2 * SIZE)
    spent = []
    for _ in range(3):
        begun = time.process_time()
        lattice = shader.lattice(of.gbuffer.size, fine, of.light)
        shader.extend(lattice, of.gbuffer, fine, of.light)
        spent.append(time.process_time() - begun)
    shader.close()
    return min(spent)


def drawn(
    of: Sitting, effects: Effects, gain: float | None, *, dark: bool
) -> tuple[Pixels, float, float]:
    """Light and expose; give the picture, its gain and the least of three times."""
    surface = nasal_scene(of.head).surface
    assert surface is not None
    shader = ScopeShader(surface, Tier.SNAPSHOT, threads=1, effects=effects)
    camera_pass = CameraPass(threads=1)
    fine = of.camera.with_size(2 * SIZE, 2 * SIZE)
    bounce = None
    if dark:
        nothing = np.zeros((*of.gbuffer.size, 3), np.float32)
        bounce = PathLight(nothing, nothing, 0)
    spent = []
    for _ in range(3):
        begun = time.process_time()
        radiance = shader.shade(of.gbuffer, fine, of.light, bounce, of.casters)
        spent.append(time.process_time() - begun)
    pixels, found = camera_pass.finish(
        downsample_radiance(radiance),
        downsample_gbuffer(of.gbuffer),
        of.camera,
        gain=gain,
    )
    shader.close()
    camera_pass.close()
    return pixels, found, min(spent)


if __name__ == "__main__":
    main()
