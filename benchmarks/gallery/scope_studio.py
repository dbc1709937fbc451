"""The endoscope's finished picture, by splats and by rays, in every tier of light."""

from dataclasses import dataclass

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


@dataclass(slots=True)
class _Head:
    """Hold what draws one head; the next head's takes its place."""

    name: str
    scene: Scene
    splats: FuzzySetRenderer
    shaders: dict[Tier, ScopeShader]

    @classmethod
    def of(cls, name: str) -> "_Head":
        scene = gallery_scene(name)
        surface = surface_of(scene)
        shaders = {tier: ScopeShader(surface, tier, threads=1) for tier in Tier}
        return cls(name, scene, FuzzySetRenderer(scene, threads=1), shaders)

    def close(self) -> None:
        self.splats.close()
        for shader in self.shaders.values():
            shader.close()


class ScopeStudio:
    """Draw the family `FAMILY`."""

    family = FAMILY

    def __init__(self) -> None:
        self._camera_pass = CameraPass(CameraSettings(noise=0), threads=1)
        self._head: _Head | None = None

    def draw(self, view: NasalView) -> list[Panel | Absent]:
        """Draw all columns, each on one thread, with the reference's gain."""
        if self._head is None or self._head.name != view.head:
            if self._head is not None:
                self._head.close()
            self._head = _Head.of(view.head)
        scene = self._head.scene
        judge = ActiveRayTracer(scene, SURFACE_QUALITY, threads=1)
        _, (truth, gain) = self._finish(view, judge, Tier.SNAPSHOT, None)
        makers: list[tuple[Renderer, Tier]] = [
            *((self._head.splats, tier) for tier in Tier),
            (ActiveRayTracer(scene, "snapshot", threads=1), Tier.LIVE),
            (ActiveRayTracer(scene, "snapshot", threads=1), Tier.FULL),
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
        self._camera_pass.close()
        if self._head is not None:
            self._head.close()

    def _finish(
        self, view: NasalView, renderer: Renderer, tier: Tier, gain: float | None
    ) -> tuple[Timing, tuple[Picture, float]]:
        assert self._head is not None
        shader = self._head.shaders[tier]
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
