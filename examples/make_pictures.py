"""Make the pictures of ``docs/``, each by its name.

    python examples/make_pictures.py classic live
    python examples/make_pictures.py debrief --page out/demo/debrief.html
    python examples/make_pictures.py gallery --views choana recess --out out/gallery
    python examples/make_pictures.py anatomy --beside patient/ --out out/sheets

`--help` tells what each name makes and which options it minds.
"""

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

import anatomy as heads
import benchmarks.deflected_turbinate as turbinate
import paravol
from anatomy.case import read_case
from app.__main__ import main as command
from app.cli.terminal import ProgressReporter
from benchmarks import light_witness, nasal_views
from benchmarks.gallery import gallery_views as views
from benchmarks.gallery.classic_studio import LIT, SEE_THROUGH, ClassicStudio
from benchmarks.gallery.contact_sheet import Rows, broken, contact_sheet
from benchmarks.gallery.gallery_page import gallery_page, picture_name
from benchmarks.gallery.light_studio import LightStudio
from benchmarks.gallery.panel import Family, Studio, encoded
from benchmarks.gallery.scope_studio import ScopeStudio, surface_of
from benchmarks.gallery.witness_studio import WitnessStudio
from benchmarks.machine import machine
from benchmarks.nasal_views import NasalView
from benchmarks.peers.light_jobs import LightJobs, mitsuba_process
from devices import load_probe_path
from paravol.patient import PatientScene, load_patient, no_progress
from paravol.sessions import session_setup as setup
from paravol.view import EndoscopeView
from renderers import scene as scenery
from renderers import shading
from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer, SplatMode
from renderers.scene import Camera, GBuffer, Projection, Volume, rmse_codes
from renderers.scene.deflection import Deflection, deflected_scene
from renderers.shading import Caster, ScopeLight, ScopeShader, Tier
from renderers.shading.illumination import Effects
from renderers.shading.kernels.path_tracing import LIFTED_MM
from renderers.shading.path_tracer import PathLight
from scenarios import Scenario, load_scenario
from scenarios.instruments import suction_tube
from system import whole_file

Pixels = NDArray[np.uint8]
Panels = Sequence[tuple[str, Pixels]]

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PICTURES = DOCS / "pictures"
BAND_PX = 36
BROWSERS = "chromium-headless-shell", "chromium"


def save(panels: Panels, columns: int, target: Path) -> None:
    """Lay captioned pictures out in rows, in fields as wide as the widest."""
    font = ImageFont.load_default(size=13)
    band = BAND_PX if any(caption for caption, _ in panels) else 0
    high = band + max(pixels.shape[0] for _, pixels in panels)
    wide = max(pixels.shape[1] for _, pixels in panels)
    grey = panels[0][1].ndim == 2
    size = columns * wide, -(-len(panels) // columns) * high
    sheet = Image.new("L" if grey else "RGB", size)
    draw = ImageDraw.Draw(sheet)
    for number, (caption, pixels) in enumerate(panels):
        x, y = number % columns * wide, number // columns * high
        text = broken(draw, font, caption, wide - 12)
        draw.multiline_text((x + 6, y + 2), text, "white", font, spacing=1)
        sheet.paste(Image.fromarray(pixels), (x, y + band))
    sheet.save(target, optimize=True)
    print(target)


def resized(
    pixels: Pixels, side: int, how: Image.Resampling = Image.Resampling.BOX
) -> Pixels:
    """Return a square picture in another size."""
    return np.asarray(Image.fromarray(pixels).resize((side, side), how))


def keep(image: Image.Image, name: str) -> None:
    """Write a picture with as many colours as a small file has room for."""
    file = PICTURES / name
    image.quantize(256).save(file, optimize=True)
    print(f"{file}: {file.stat().st_size / 1e3:.0f} kB")


def browsed(page: Path, width: int, height: int) -> Image.Image:
    """Have a Chromium without a window draw a page."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise SystemExit("There is no Chromium to draw the page with.")
    with tempfile.TemporaryDirectory() as folder:
        drawn = Path(folder) / "page.png"
        words = [browser, "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
        words += [f"--user-data-dir={folder}/profile", f"--screenshot={drawn}"]
        words += [f"--window-size={width},{height}", page.as_uri()]
        subprocess.run(words, check=True, capture_output=True)
        with Image.open(drawn) as image:
            return image.convert("RGB")


ANATOMY_MM = 0.5
FIELD_MM = ((-52.0, 52.0), (-20.0, 92.0), (-14.0, 80.0))
PLANES_MM = ((1, 27.0), (1, 64.0), (2, 38.0), (0, 9.0))
"""Axis and place: through the ostiomeatal complex, the sphenoid sinuses, the ethmoid,
and beside the septum."""
NOSTRILS_MM = np.array((0.0, -11.5, -9.0))
"""Between the nostrils of the average head, from its nasal spine; LPS."""
LOW_HU, HIGH_HU = -650.0, 1350.0
SIDE_PX = 224
SCOPE_VIEWS = """
average, nostril       || nostril, right     | nasal valve, right | 4
average, middle meatus || nasal valve, right | middle meatus, right | 12
average, recess        || nostril, right     | sphenoethmoidal recess, right | 48
average, choana        || nostril, left      | choana, left | 40
concha bullosa    | concha-bullosa:right | nasal valve, right \
    | middle meatus, right | 10
paradoxical turbinate | paradoxical-turbinate:left | nasal valve, left \
    | middle turbinate head, left | 13
septal spur       | septal-spur:right | nasal valve, right | choana, right | 8
septal deviation  | septal-deviation  | nasal valve, right | choana, right | 4
polyps, grade 2   | polyps:right=2    | nasal valve, right | middle meatus, right | 8
polyps, grade 3   | polyps:left=3     | nasal valve, left  | middle meatus, left | 4
antrostomy, fluid | antrostomy:right=120 fluid:maxillary:right=0.3 posture=upright \
    | -8.0 23.4 26.2 | -19.0 35.4 12.4 | 0
congested         | congestion=1      | nasal valve, left  | choana, left | 0
"""
"""Caption; variants and diseases; where the scope comes from and looks: landmarks, or
LPS, mm; how far it has come, mm."""


def anatomy(asked: argparse.Namespace) -> None:
    """anatomy_seeds.png, anatomy_views.png: planes of twelve drawn heads; what a scope
    sees in twelve, one for each of the variants and diseases named above it. --beside
    puts an imported patient first, whose nasal spine --spine tells."""
    folder = asked.out or PICTURES
    if asked.beside is not None and asked.out is None:
        raise SystemExit("--beside needs --out: a patient's scan is not for the docs")
    folder.mkdir(parents=True, exist_ok=True)
    panels = [] if asked.beside is None else [real(asked.beside, asked.spine)]
    for seed in range(12):
        parameters = heads.draw_parameters(seed)
        ct = heads.build_phantom(parameters, ANATOMY_MM, field_mm=FIELD_MM).ct
        # what most sides have is not told
        usual = ("agger", "retrobulbar", "suprabullar")
        rare = [v for v in parameters.variants if not v.startswith(usual)]
        words = [v.replace(":left", " L").replace(":right", " R") for v in rare]
        line = ", ".join([f"{seed}: keros {parameters.keros_mm:.1f}", *words])
        panels.append((line, planes(ct, parameters.head_scale)))
    save(panels, 2, folder / "anatomy_seeds.png")
    rows = [row.split("|") for row in SCOPE_VIEWS.strip().splitlines()]
    save([scope_view(*row) for row in rows], 6, folder / "anatomy_views.png")


def scope_view(
    caption: str, findings: str, start: str, goal: str, forward_mm: str
) -> tuple[str, Pixels]:
    """Draw what the scope sees in one head."""
    words = findings.split()
    patient = paravol.phantom(
        average=True,
        spacing_mm=ANATOMY_MM,
        variants=tuple(word for word in words if "=" not in word),
        disease=tuple(word for word in words if "=" in word),
    )
    pose = patient.pose(place(start), place(goal), forward_mm=float(forward_mm))
    return caption.strip(), patient.look(pose, size=SIDE_PX).rgb


def place(text: str) -> str | list[float]:
    """Read a landmark's name, or three coordinates."""
    return [float(word) for word in text.split()] if "." in text else text.strip()


def real(folder: Path, spine_mm: list[float] | None) -> tuple[str, Pixels]:
    """Give an imported patient's planes; without a spine it is placed by the entry.

    The scan is cut to the synthetic heads' field about its spine; air where it ends.
    """
    case = read_case(folder)
    entries = [m.position_mm for m in case.landmarks.values() if "nostril" in m.name]
    entries = entries or [case.landmarks["entrance"].position_mm]
    spine = np.mean(entries, axis=0) - NOSTRILS_MM if spine_mm is None else spine_mm
    low, step = case.ct.origin_mm - np.asarray(spine), case.ct.spacing_mm
    first, last = np.round((np.array(FIELD_MM).T - low) / step).astype(int)
    values = np.full((last - first)[::-1], -1000, np.int16)
    begin, end = np.maximum(first, 0), np.minimum(last, case.ct.values.shape[::-1])
    spans = list(zip(begin[::-1], end[::-1], first[::-1], strict=True))
    target = tuple(slice(a - zero, b - zero) for a, b, zero in spans)
    values[target] = case.ct.values[tuple(slice(a, b) for a, b, _ in spans)]
    about = Volume(values, step, low + first * step)
    return f"{folder.name}: a real scan", planes(about, 1.0)


def planes(ct: Volume, scale: float) -> Pixels:
    """Cut four planes of a head whose lengths are `scale` times the average's.

    Its nasal spine lies at the origin. Shown at bone window, fitted into squares.
    """
    low, step = np.asarray(ct.origin_mm), np.asarray(ct.spacing_mm)
    squares = []
    for axis, at_mm in PLANES_MM:
        at = round((at_mm * scale - float(low[axis])) / float(step[axis]))
        at = min(max(at, 0), ct.values.shape[2 - axis] - 1)
        cut = np.take(ct.values, at, axis=2 - axis)
        hu = cut if axis == 2 else cut[::-1]
        share = np.clip((hu.astype(float) - LOW_HU) / (HIGH_HU - LOW_HU), 0.0, 1.0)
        picture = Image.fromarray((255 * share).astype(np.uint8))
        picture.thumbnail((SIDE_PX, SIDE_PX), Image.Resampling.LANCZOS)
        square = Image.new("L", (SIDE_PX + 2, SIDE_PX + 2))
        square.paste(picture)
        squares.append(np.asarray(square))
    return np.hstack(squares)


def classic(asked: argparse.Namespace) -> None:
    """classic.png: bone from the front and the passage from the nasopharynx, each as
    points and as single splats, under the four infinite lights of 1995."""
    phantom = heads.sinus_phantom(spacing_mm=0.5)
    tissue = scenery.Scene(phantom.ct, heads.classic_transfer_function())
    bone = replace(tissue, transfer_function=heads.bone_transfer_function())
    marks = {name: mark.position_mm for name, mark in phantom.landmarks.items()}
    centre = phantom.ct.center_mm
    before, behind = centre + np.array([90.0, -260.0, 40.0]), marks["nasopharynx"]
    turbinate_mm = marks["inferior turbinate head, left"]
    shown = (bone, before, centre, 13), (tissue, behind, turbinate_mm, 40)
    panels = []
    for scene, eye, target, degrees in shown:
        extent = math.radians(degrees)
        camera = Camera.looking_at(eye, target, extent=extent, size=(400, 400))
        camera = replace(camera, projection=Projection.PERSPECTIVE)
        with closing(FuzzySetRenderer(scene)) as renderer:
            for mode in SplatMode:
                renderer.mode = mode
                pixels = encoded(renderer.render(camera).rgba[..., :3])
                label = f"{mode.value}, {renderer.counters['splats']} splats"
                panels.append((label, pixels))
    save(panels, len(SplatMode), PICTURES / "classic.png")


def deflections(asked: argparse.Namespace) -> None:
    """deflections.png: a turbinate deformed; above by bent rays, below by splats."""
    scene = turbinate.turbinate_scene(heads.sinus_phantom())
    camera = turbinate.turbinate_camera()
    columns = []
    for name in ("as it is", "pulled aside", "turned", "swollen", "shrunk", "cut"):
        deflection = turbinate.DEFORMATIONS.get(name, Deflection())
        # light and tint of both are those of the deformed tissue
        light = partial(turbinate.turbinate_picture, deflected_scene(scene, deflection))
        bent = ActiveRayTracer(scene, deflection=deflection).gbuffer(camera)
        rays, gain = light(bent, None)
        with closing(FuzzySetRenderer(scene, deflection=deflection)) as splatter:
            splats, _ = light(splatter.gbuffer(camera), gain)
        alike = scenery.ssim(splats, rays)
        print(f"{name:14s} SSIM {alike:.3f}, {rmse_codes(splats, rays):.1f} codes")
        columns.append(("", np.vstack([rays, splats])))
    save(columns, len(columns), PICTURES / "deflections.png")


LIVE_PX = 384
FLOWN_S = (0.5, 6.5, 9.5, 15.0, 18.5, 20.0)
OPERATED_S = (1.5, 16.1, 105.0, 118.0)


def live(asked: argparse.Namespace) -> None:
    """first_flight.png, first_operation.png: moments of the bundled flight and of the
    bundled operation. nasal_views.png: six views, each live by splats beside the ray
    tracer's snapshot of the same pose with the same gain."""
    save(first_flight(), 3, PICTURES / "first_flight.png")
    save(first_operation(), 4, PICTURES / "first_operation.png")
    seen = nasal_views.acceptance_views(LIVE_PX)
    save(
        [panel for view in seen for panel in both(view)],
        4,
        PICTURES / "nasal_views.png",
    )


def trainees_view(scenario: Scenario, patient: PatientScene) -> EndoscopeView:
    """Set up what a trainee sees."""
    return setup.build_view(scenario, patient, threads=2)


def first_flight() -> Panels:
    """Fly to the moments; the gain settles at each."""
    scenario, path = nasal_views.bundled_flight()
    patient = load_patient(scenario, no_progress)
    view = trainees_view(scenario, patient)
    panels = []
    for number, time_s in enumerate(FLOWN_S):
        seen = setup.path_view(scenario, patient, path, time_s, (LIVE_PX, LIVE_PX))
        panels.append(("", view.draw(seen, number=number, elapsed_s=10.0).pixels))
    return panels


def first_operation() -> Panels:
    """Operate up to the moments; the gain settles at each."""
    scenario, folder = load_scenario("first_operation")
    path = load_probe_path(folder / scenario.path)
    patient, operation = setup.operate_on(load_patient(scenario, no_progress))
    size = (LIVE_PX, LIVE_PX)
    session = setup.build_session(scenario, patient, np.eye(4), size, operation)
    view = trainees_view(scenario, patient)
    waiting = list(OPERATED_S)
    panels: list[tuple[str, Pixels]] = []
    for sample in views.operated_samples(path, scenario.scope.endoscope()):
        session.step(sample)
        if waiting and sample.time_s >= waiting[0]:
            waiting.pop(0)
            view.apply(operation.take_changes())
            seen, number = session.view(sample), len(panels)
            panels.append(("", view.draw(seen, number=number, elapsed_s=10.0).pixels))
    return panels


def both(view: NasalView) -> Panels:
    """Draw a view by splats in tier LIVE and by rays in tier SNAPSHOT."""
    scene, finish = nasal_views.nasal_scene(view.head), shading.CameraPass()
    shaders = {
        tier: ScopeShader(surface_of(scene), tier, seed=setup.SEED) for tier in Tier
    }
    fine = view.camera.with_size(2 * LIVE_PX, 2 * LIVE_PX)
    rays = ActiveRayTracer(scene).gbuffer(fine)
    traced, gain = shading.scope_picture(
        rays, view.camera, shaders[Tier.SNAPSHOT], finish, view.light
    )
    splats = FuzzySetRenderer(scene).gbuffer(view.camera)
    drawn, _ = shading.scope_picture(
        splats, view.camera, shaders[Tier.LIVE], finish, view.light, gain
    )
    return (f"{view.name}: live", drawn), ("snapshot", traced)


INGREDIENT_PX = 512


@dataclass(frozen=True, slots=True)
class TracedView:
    """A view with what rays found in it, four samples a pixel."""

    view: NasalView
    fine: Camera
    gbuffer: GBuffer
    casters: tuple[Caster, ...] = ()

    def shader(self, effects: Effects) -> ScopeShader:
        """Return a snapshot's light with some of its parts."""
        surface = surface_of(nasal_views.nasal_scene(self.view.head))
        return ScopeShader(surface, Tier.SNAPSHOT, threads=1, effects=effects)


def ingredients(asked: argparse.Namespace) -> None:
    """ingredients.png: pairs of a view without and with one part of the light, all
    others as in a snapshot, by one exposure; the share of the light's time that it
    takes, and the root mean square difference in codes of 255."""
    seen = {v.name: v for v in nasal_views.acceptance_views(INGREDIENT_PX)}
    tool = with_tool()
    pairs: tuple[tuple[str, TracedView, str], ...] = (
        ("shadow of the tool", tool, "tool_shadow"),
        ("walls in metal", tool, "metal_mirror"),
        ("hairs", traced_view(seen["vestibule"]), "hairs"),
        ("walls in the wet film", traced_view(seen["choana"]), "film_mirror"),
        ("light through thin walls", traced_view(seen["recess"]), "thin_walls"),
        ("light from wall to wall", traced_view(seen["middle meatus"]), ""),
    )
    everything = Tier.SNAPSHOT.effects
    panels: list[tuple[str, Pixels]] = []
    for name, traced, part in pairs:
        full, gain, cost = lit(traced, everything)
        # what follows light by paths does not ask for the light from wall to wall
        less, _, saved = lit(
            traced,
            replace(everything, **{part: False}) if part else everything,
            gain,
            dark=not part,
        )
        extra = max(cost - saved, 0.0)
        codes = f"{rmse_codes(less, full):.1f} codes"
        caption = f"{name}: {100 * extra / cost:.0f} % of the time"
        print(f"{caption}, {codes}")
        panels += [(caption, less), (codes, full)]
    small = [(text, resized(pixels, 220)) for text, pixels in panels]
    save(small, 4, PICTURES / "ingredients.png")


def traced_view(view: NasalView) -> TracedView:
    """Trace a view."""
    fine = view.camera.with_size(2 * INGREDIENT_PX, 2 * INGREDIENT_PX)
    tracer = ActiveRayTracer(nasal_views.nasal_scene(view.head), threads=1)
    return TracedView(view, fine, tracer.gbuffer(fine))


def with_tool() -> TracedView:
    """Trace a place of the bundled flight with the suction tube before the lens."""
    scenario, path = nasal_views.bundled_flight()
    patient, size = load_patient(scenario, no_progress), (INGREDIENT_PX, INGREDIENT_PX)
    *_, seen = setup.first_views(scenario, patient, path, size)
    light = ScopeLight(scenario.scope.ring_radius_mm)
    bare = traced_view(NasalView("tool", "default", seen.camera, light))
    tube, at = suction_tube(), seen.world_from_instrument
    tube.draw(bare.gbuffer, bare.fine, at)
    return replace(bare, casters=(Caster.of(tube, at),))


def lit(
    of: TracedView, effects: Effects, gain: float | None = None, dark: bool = False
) -> tuple[Pixels, float, float]:
    """Light and expose; give the picture, its gain and the least of three times.

    dark: without the light from wall to wall.
    """
    nothing = np.zeros((*of.gbuffer.size, 3), np.float32)
    bounce = PathLight(nothing, nothing, 0) if dark else None
    spent_s = []
    with closing(of.shader(effects)) as shader:
        for _ in range(3):
            begun_s = time.process_time()
            radiance = shader.shade(
                of.gbuffer, of.fine, of.view.light, bounce, of.casters
            )
            spent_s.append(time.process_time() - begun_s)
    with closing(shading.CameraPass(threads=1)) as film:
        gbuffer = shading.downsample_gbuffer(of.gbuffer)
        small = shading.downsample_radiance(radiance)
        pixels, found = film.finish(small, gbuffer, of.view.camera, gain=gain)
    return pixels, found, min(spent_s)


WITNESS_PX, BATCHES, PASSES, PATHS = 32, 64, 16, 64
SHOWN = ("turbinate", "ostium", "wound, nearer")
WAYS = {"Mitsuba, own way": None, "off walls as ours": LIFTED_MM}


def light(asked: argparse.Namespace) -> None:
    """light_witness.png and the table of docs/light.md: our light from wall to wall,
    Mitsuba's by its own way and with paths that leave walls as ours do, either with the
    difference of the red light, blue where theirs is darker. Needs Mitsuba, and ten to
    twenty minutes."""
    print(f"| view | straight | {' | '.join(WAYS)} |\n| --- | ---: | ---: | ---: |")
    panels: list[tuple[str, Pixels]] = []
    with closing(mitsuba_process()) as peer:
        for view in views.gallery_views(WITNESS_PX):
            surface = surface_of(views.gallery_scene(view.head))
            room = light_witness.DiffuseRoom(view, surface)
            jobs = LightJobs(peer, room.surface.distance, room.albedo)
            ask = partial(jobs.job, room.camera, room.light, paths=PATHS, passes=PASSES)
            own, _ = room.bounced(BATCHES)
            direct = jobs.passes(ask(bounces=0, bounced_only=False, refined=2))[0]
            away = direct.mean(dtype=float) / room.straight().mean.mean() - 1
            cells = [view.name, f"{100 * away:+.2f} %"]
            exposure = np.quantile(own.mean, 0.98)
            row = [(f"{view.name}: ours", encoded(own.mean / exposure))]
            for name, lifted_mm in WAYS.items():
                job = ask(bounces=light_witness.BOUNCES, refined=2, lifted_mm=lifted_mm)
                theirs = light_witness.Estimate.of_passes(jobs.passes(job)[0])
                found = light_witness.LightDifference.of(own, theirs)
                error = 100 * found.mean_error
                cells.append(f"{100 * found.mean:+.2f} +- {error:.2f} %")
                row.append((name, encoded(theirs.mean / exposure)))
                row.append(("difference", difference(own.mean, theirs.mean)))
            print(f"| {' | '.join(cells)} |", flush=True)
            panels += row if view.name in SHOWN else []
    near = Image.Resampling.NEAREST
    shown = [(name, resized(pixels, 160, near)) for name, pixels in panels]
    save(shown, 1 + 2 * len(WAYS), PICTURES / "light_witness.png")


def difference(own: NDArray[np.float64], theirs: NDArray[np.float64]) -> Pixels:
    """Paint the difference of the red light: red where theirs is brighter.

    A quarter of the mean light is shown as full red or blue.
    """
    share = np.clip((theirs - own)[..., 0] / (own[..., 0].mean() / 4), -1, 1)
    pale = 1 - np.abs(share)
    red, blue = np.where(share > 0, 1, pale), np.where(share < 0, 1, pale)
    codes = np.rint(255 * np.stack([red, pale, blue], axis=-1))
    return np.asarray(codes, np.uint8)


SNAPSHOT_PX = 256
# the middle turbinate, right, from in front
EYE_MM, LOOK_MM = [-5.235, 8.632, 19.059], [-5.9, 14.3, 24.0]
VIEW: dict[str, Any] = {
    "schema": "paravol.view/1",
    "head": {"kind": "phantom", "seed": 1},
    "camera": {"eye_mm": EYE_MM, "target_mm": LOOK_MM, "extent": 0.7},
    "size_px": [SNAPSHOT_PX, SNAPSHOT_PX],
}
PINHOLE = VIEW["camera"] | {"projection": "perspective"}
SWOLLEN = {"kind": "scale", "center_mm": [-6.1, 15.7, 25.4], "radius_mm": 7.0}
CUT = {"kind": "cut", "center_mm": [-6.0, 15.0, 24.7], "radius_mm": 5.0}
OPENED = CUT | {"normal": [1.0, 0.0, 0.0], "pull_mm": 1.2}
# from just beside the septum: what lies before the eye is cut away
SIDE_WALL = {
    "eye_mm": [-2.0, 25.0, 22.0],
    "target_mm": [-30.0, 25.0, 22.0],
    "extent": 31.0,
    "projection": "orthographic",
}
CLASSIC = {"look": {"mode": "classic"}}
SHOTS: tuple[tuple[str, dict[str, Any], str], ...] = (
    ("snapshot", {}, "--against fsr --confidence {folder}/doubt.png"),
    ("--path-traced, 64 paths", {}, "--path-traced --path-samples 64 --samples 1"),
    ("swollen: bent rays", {"deflectors": [SWOLLEN | {"factor": 1.8}]}, ""),
    ("cut: bent rays", {"deflectors": [OPENED]}, ""),
    ("orthographic: the side wall", CLASSIC | {"camera": SIDE_WALL}, ""),
    (
        "stopped after 1.5 s",
        CLASSIC | {"camera": PINHOLE},
        "--quality reference --time-limit 1.5",
    ),
)


def snapshots(asked: argparse.Namespace) -> None:
    """snapshots.png: what `paravol snapshot` writes of one view, from a view file."""
    panels = []
    with tempfile.TemporaryDirectory() as folder:
        out, view = Path(folder) / "shot.png", Path(folder) / "view.json"
        for caption, change, told in SHOTS:
            view.write_text(json.dumps(VIEW | change))
            words = ["--view", str(view), "--out", str(out)]
            words += told.format(folder=folder).split()
            if command(["snapshot", *words]) != 0:
                raise SystemExit(f"paravol snapshot {' '.join(words)} failed")
            panels.append((caption, pixels_of(out)))
            if not panels[-1][1].any():
                raise SystemExit("no ray was traced; run this on a quieter machine")
        # the rightmost square is what these pictures are made for
        square = slice(-SNAPSHOT_PX, None)
        error = pixels_of(Path(folder) / "shot-error.png")[square, square]
        doubt = pixels_of(Path(folder) / "doubt.png")[:, square]
    panels[1:1] = [("--against fsr: difference", error), ("--confidence", doubt)]
    save(panels, 4, PICTURES / "snapshots.png")


def pixels_of(file: Path) -> Pixels:
    """Read a picture."""
    with Image.open(file) as image:
        return np.asarray(image.convert("RGB"))


DEBRIEF_PX = 1024, 9000
DEBRIEF_PARTS = "timeline", "hazards", "wounds"
DEBRIEF_STYLE = """
<style>section, header, nav, footer { display: none }
%s { display: block } main { padding: 1rem }
.events li:nth-child(n + 7) { display: none } h2 { margin-top: 1rem }
#wounds ~ p { max-width: none } .pair { max-width: 40rem }</style></head>
"""
PAGES = "home", "flight", "result", "compared", "volume", "connection"
SCREEN = ["xvfb-run", "-a", "-s", "-screen 0 3840x2160x24 -nolisten tcp"]
WALK = ["-m", "pytest", "-q", "-p", "pytestqt.plugin", "-p", "no:cacheprovider", "-s"]
TRAIN = "-m app train --no-store --scenario first_operation --input emulator"
WATCHED = "--sound off --instructor-page 0 --seconds 25 --size 512"
MOMENT_S = 12.0


def debrief(asked: argparse.Namespace) -> None:
    """debrief.png: parts of the demonstration's debrief (--page)."""
    shown = ", ".join(f'section[aria-labelledby="{part}"]' for part in DEBRIEF_PARTS)
    text = asked.page.read_text("utf-8")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "page.html"
        file.write_text(text.replace("</head>", DEBRIEF_STYLE % shown, 1), "utf-8")
        whole = browsed(file, *DEBRIEF_PX)
    # the page is white; what is not ends above this row
    inked = whole.convert("L").point(lambda level: 255 * (level < 250)).getbbox()
    assert inked is not None
    width, height = DEBRIEF_PX
    keep(whole.crop((0, 0, width, min(inked[3] + 16, height))), "debrief.png")


def window(asked: argparse.Namespace) -> None:
    """window_*.png: the pages that the test's trainee comes along
    (`tests/app/window/journey.py`), on a virtual screen (Debian: xvfb), and the
    instructor's. --references renews the test's small pictures instead: look at them
    before you keep them."""
    if asked.references:
        walk(JOURNEY_RENEW="1")
        return
    with tempfile.TemporaryDirectory() as folder:
        walk(JOURNEY_PICTURES=folder)
        for page in PAGES:
            with Image.open(Path(folder) / f"{page}-1280.png") as image:
                keep(image.convert("RGB"), f"window_{page}.png")
        keep(instructors_page(Path(folder)), "window_instructor.png")


def walk(**told: str) -> None:
    """Go the whole way through the window, and its environment told so."""
    # the page of results tells where a flight is recorded
    place = Path(tempfile.gettempdir()) / "paravol"
    words = [*SCREEN, sys.executable, *WALK, "--timeout=900", f"--basetemp={place}"]
    environment = os.environ | told | {"QT_QPA_PLATFORM": "xcb"}
    words.append("tests/app/window/journey.py")
    subprocess.run(words, cwd=ROOT, env=environment, check=True)


def instructors_page(folder: Path) -> Image.Image:
    """Fly the bundled operation, and have a browser draw what an instructor sees.

    A browser that draws to a file waits for the end of what it loads, and the page's
    streams have none: it gets one moment of both.
    """
    words = [*SCREEN, sys.executable, *TRAIN.split(), *WATCHED.split()]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        line = next(line for line in child.stdout if "http://" in line)
        picture = browsed(moment_of(line.split()[-1], folder), 1280, 720)
        child.communicate()
    return picture


def moment_of(address: str, folder: Path) -> Path:
    """Keep the page with one state and one picture; return its file."""
    with urlopen(f"{address}states") as states:
        lines = (line.decode() for line in states if line.startswith(b"data: "))
        told = (line.removeprefix("data: ") for line in lines)
        state = next(t for t in told if json.loads(t).get("clock_s", 0.0) > MOMENT_S)
    for name in ("picture.jpg", "instructor.js", "instructor.css"):
        with urlopen(f"{address}{name}") as file:
            (folder / name).write_bytes(file.read())
    with urlopen(address) as file:
        text = file.read().decode().replace('src="pictures"', 'src="picture.jpg"')
    told_once = f"setTimeout(() => this.onmessage({{data: {json.dumps(state)}}}))"
    stub = f"window.EventSource = class {{ constructor() {{ {told_once} }} }}"
    page = folder / "page.html"
    page.write_text(text.replace("<head>", f"<head><script>{stub}</script>", 1))
    return page


GALLERY_PX = 112
LEAST_PX, MOST_PX = 32, 512


def gallery(asked: argparse.Namespace) -> None:
    """gallery.md and a sheet for each family, gallery_*.png: the same views by every
    mode, light and peer (--views, --size, --out). All is written at the end: Ctrl-C
    leaves everything as it was. Peers that are not installed are named in the page."""
    folder, where = asked.out or DOCS, machine()
    chosen = [v for v in views.gallery_views(asked.size) if v.name in asked.views]
    with ProgressReporter() as stages:
        sheets = gallery_sheets(chosen, stages)
    for family, rows in sheets.items():
        with whole_file(folder / "pictures" / picture_name(family)) as path:
            contact_sheet(family, rows, GALLERY_PX).save(path, "PNG", optimize=True)
    with whole_file(folder / "gallery.md") as path:
        path.write_text(gallery_page(sheets, where, asked.size), encoding="utf-8")
    print(folder / "gallery.md")


def gallery_sheets(
    chosen: list[NasalView], stages: ProgressReporter
) -> dict[Family, Rows]:
    """Draw every view in every family, one family after the other."""
    studios: list[Callable[[], Studio]] = [
        ScopeStudio,
        LightStudio,
        partial(ClassicStudio, LIT),
        partial(ClassicStudio, SEE_THROUGH),
        WitnessStudio,
    ]
    # a head's pictures together: building what draws it takes longer than they do
    ordered = sorted(chosen, key=lambda view: view.head)
    sheets: dict[Family, Rows] = {}
    for make in studios:
        with closing(make()) as studio:
            made = {}
            for number, view in enumerate(ordered):
                stages(studio.family.title, number / len(ordered))
                made[view.name] = studio.draw(view)
            stages(studio.family.title, 1.0)
            sheets[studio.family] = {view.name: made[view.name] for view in chosen}
    return sheets


MAKERS: dict[str, Callable[[argparse.Namespace], None]] = {
    maker.__name__: maker
    for maker in (
        *(anatomy, classic, debrief, deflections, gallery),
        *(ingredients, light, live, snapshots, window),
    )
}


def main(words: list[str] | None = None) -> int:
    """Make what was asked for; give the exit status."""
    names = [view.name for view in views.gallery_views(LEAST_PX)]
    told = "\n\n".join(f"{name}: {maker.__doc__}" for name, maker in MAKERS.items())
    parser = argparse.ArgumentParser(
        description=(__doc__ or "").splitlines()[0],
        epilog=f"{told}\n\nViews of the gallery: {', '.join(names)}.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("names", nargs="+", choices=MAKERS, metavar="NAME")
    parser.add_argument("--out", type=Path, help="folder, of anatomy and gallery")
    parser.add_argument("--beside", type=Path, help="an imported patient's folder")
    parser.add_argument(
        "--spine", type=float, nargs=3, metavar=("X", "Y", "Z"), help="LPS, mm"
    )
    page = Path("out/demo/debrief.html")
    parser.add_argument("--page", type=Path, default=page, help=f"a debrief; {page}")
    parser.add_argument("--references", action="store_true", help="of the window")
    parser.add_argument("--views", nargs="+", metavar="VIEW", default=names)
    size_help = f"of the gallery's pictures, pixels; {GALLERY_PX}"
    parser.add_argument("--size", type=int, default=GALLERY_PX, help=size_help)
    asked = parser.parse_args(words)
    if unknown := sorted(set(asked.views) - set(names)):
        parser.error(f"no view is called {unknown[0]!r}")
    if not LEAST_PX <= asked.size <= MOST_PX or asked.size % 2:
        parser.error(f"--size must be even, {LEAST_PX} to {MOST_PX}, got {asked.size}")
    try:
        for name in asked.names:
            MAKERS[name](asked)
    except KeyboardInterrupt:
        print(f"Stopped; nothing of {name} was written.", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
