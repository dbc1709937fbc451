"""The endoscope's finished picture, by splats and by rays, in every tier of light."""

from contextlib import ExitStack

from benchmarks.gallery.gallery_views import gallery_scene
from benchmarks.gallery.panel import Absent, Family, Panel, Picture, likeness
from benchmarks.nasal_views import NasalView
from benchmarks.references import SURFACE_NAME, SURFACE_QUALITY
from benchmarks.timing import Timing, measure
from renderers.art import ActiveRayTracer, Quality
from renderers.fsr import FuzzySetRenderer
from renderers.scene import AirSurface, Renderer, Scene, rmse_codes
from renderers.shading import (
    CameraPass,
    CameraSettings,
    ScopeShader,
    Tier,
    scope_picture,
)

BUDGET_S = 0.15
REFERENCE = "reference"
FINE = ("preview", "snapshot", "final")
FAMILY = Family(
    "scope",
    "The endoscope's picture: FSR and ART, each tier",
    (
        *(f"FSR, {tier.name}" for tier in Tier),
        f"ART snapshot, {Tier.LIVE.name}",
        f"ART snapshot, {Tier.FULL.name}",
        *(f"ART {name}, {Tier.SNAPSHOT.name}" for name in FINE),
        REFERENCE,
    ),
    f"{SURFACE_NAME}, tier SNAPSHOT, the same gain for all",
    "rms of 255 codes",
    "Geometry, light and camera together, without grain. A tier is how finely light "
    "is sampled; rays and splats share it, so that columns of one tier differ in "
    "geometry only.",
)


class ScopeStudio:
    """Draw the family `FAMILY`."""

    family = FAMILY

    def __init__(self) -> None:
        self._camera_pass = CameraPass(CameraSettings(noise=0), threads=1)
        self._head = ""
        self._open = ExitStack()

    def draw(self, view: NasalView) -> list[Panel | Absent]:
        """Draw all columns, each on one thread, with the reference's gain."""
        scene = gallery_scene(view.head)
        if view.head != self._head:
            self._prepare(view.head, scene)
        judge = ActiveRayTracer(scene, SURFACE_QUALITY, threads=1)
        _, (truth, gain) = self._finish(view, judge, Tier.SNAPSHOT, None)
        snapshot = ActiveRayTracer(scene, "snapshot", threads=1)
        makers: list[tuple[Renderer, Tier]] = [
            *((self._splats, tier) for tier in Tier),
            (snapshot, Tier.LIVE),
            (snapshot, Tier.FULL),
            *(
                (ActiveRayTracer(scene, Quality.named(name), threads=1), Tier.SNAPSHOT)
                for name in FINE
            ),
            (judge, Tier.SNAPSHOT),
        ]
        panels: list[Panel | Absent] = []
        for who, (renderer, tier) in zip(FAMILY.columns, makers, strict=True):
            timing, (pixels, _) = self._finish(view, renderer, tier, gain)
            off = rmse_codes(pixels, truth)
            alike = likeness(pixels, truth)
            panels.append(Panel(who, pixels, timing.cpu_s, off, alike))
        return panels

    def close(self) -> None:
        """End the threads."""
        self._open.close()
        self._camera_pass.close()

    def _prepare(self, head: str, scene: Scene) -> None:
        """Make what draws one head; the last head's goes."""
        self._open.close()
        surface = surface_of(scene)
        self._head = head
        self._splats = FuzzySetRenderer(scene, threads=1)
        self._shaders = {tier: ScopeShader(surface, tier, threads=1) for tier in Tier}
        self._open.callback(self._splats.close)
        for shader in self._shaders.values():
            self._open.callback(shader.close)

    def _finish(
        self, view: NasalView, renderer: Renderer, tier: Tier, gain: float | None
    ) -> tuple[Timing, tuple[Picture, float]]:
        shader = self._shaders[tier]
        side = view.camera.width * tier.supersampling
        fine = view.camera.with_size(side, side)

        def finished() -> tuple[Picture, float]:
            return scope_picture(
                renderer.gbuffer(fine),
                view.camera,
                shader,
                self._camera_pass,
                view.light,
                gain,
            )

        return measure(finished, budget_s=BUDGET_S, least=2)


def surface_of(scene: Scene) -> AirSurface:
    """Return the wall that the endoscope sees; each of the gallery's heads has one."""
    assert scene.surface is not None
    return scene.surface
