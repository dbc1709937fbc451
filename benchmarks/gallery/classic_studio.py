"""Mode `classic` in a nose: rays, splats and the programs that others use."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.gallery.gallery_views import gallery_scene, pinhole
from benchmarks.gallery.panel import Absent, Family, Panel, encoded, likeness
from benchmarks.gallery.scope_studio import BUDGET_S, FINE
from benchmarks.nasal_views import NasalView
from benchmarks.peers.peer_jobs import VolumeJobs, splat_job
from benchmarks.peers.peer_process import Answer, PeerProcess
from benchmarks.plan import UnavailableError
from benchmarks.references import REFERENCE_NAME, REFERENCE_QUALITY, rgb_over_black
from benchmarks.timing import Timing, measure, once
from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer, SplatMode
from renderers.scene import Camera, PhongMaterial, Scene, TransferFunction, image_error

Linear = NDArray[np.float32]

STEP_VOXELS = 0.5
"""Of the peers that obey one, as ART in quality snapshot."""

RIGHT = 0.025, 0.9
"""Largest RMSE and least SSIM with which a peer's picture is right. Its time counts
only then. Lights on both sides of a wall were .044 to .054 off, ambient light without
the tissue's colour .18 to .26."""

COARSE_RIGHT = 0.04, 0.75
"""The same for who draws whole voxels or splats: about as far as our own coarsest mode,
points, is from the reference (.0386 and .778 in these views)."""

THINNING = 0.03
"""Of the extinction of mode classic: some centimetres of tissue are seen through."""

SPLATS = "VTK splats, sorted"
GAUSSIAN = f"FSR {SplatMode.GAUSSIAN.value}"
REFERENCE = "reference"
PYVISTA = "pyvista default"
COARSE = SPLATS, PYVISTA
VOLUME_PEERS = {
    "VTK fixed-point": "vtk_volume",
    "VTK GPU mapper": "vtk_gpu_volume",
    PYVISTA: "pyvista_volume",
    "yt": "yt_volume",
}
"""Column and module in `benchmarks.peers`."""

LIT = Family(
    "classic_lit",
    "Mode classic under four lights",
    (
        *(f"ART {name}" for name in FINE),
        *(f"FSR {mode.value}" for mode in SplatMode),
        SPLATS,
        *list(VOLUME_PEERS)[:3],
        REFERENCE,
    ),
    REFERENCE_NAME,
    "RMSE of linear light",
    "Opaque tissue. There is no ambient light, since VTK's GPU mapper adds it without "
    f"the tissue's colour. {SPLATS} is given the splats of {GAUSSIAN}, without those "
    "that reach the eye; it is right where it draws that picture or the reference, "
    "all others where they draw the reference. An eye within a splat's reach, as in "
    f"view ostium, sees nothing else in {GAUSSIAN}. yt has no such lights. pyvista "
    "takes the nearest voxel by default, hence its cubes.",
)
SEE_THROUGH = Family(
    "classic_see_through",
    "Mode classic, thin tissue without lights",
    (*(f"ART {name}" for name in FINE), *VOLUME_PEERS, REFERENCE),
    REFERENCE_NAME,
    "RMSE of linear light",
    f"The same colours with {THINNING:g} of the extinction: emission and absorption "
    "only, which all volume renderers draw alike. yt blends in the order of its "
    "samples, later over earlier, so that it is given rays that come from afar to "
    "the eye. Splats stand for opaque boundaries and are not asked.",
)


class ClassicStudio:
    """Draw one of `LIT` and `SEE_THROUGH`."""

    def __init__(self, family: Family) -> None:
        self.family = family
        modules = {who: f"benchmarks.peers.{VOLUME_PEERS[who]}" for who in self._volume}
        if SPLATS in family.columns:
            modules[SPLATS] = "benchmarks.peers.vtk_splats"
        self._peers = {who: PeerProcess(module) for who, module in modules.items()}
        self._jobs: dict[str, VolumeJobs] = {}
        self._head = ""
        self._splats: FuzzySetRenderer | None = None

    def draw(self, view: NasalView) -> list[Panel | Absent]:
        """Draw all columns, each on one thread."""
        camera = pinhole(view.camera)
        scene = self._scene(view.head)
        timing, truth = once(lambda: self._rays(scene, camera))
        found: dict[str, Panel | Absent] = {}
        for name in FINE:
            tracer = ActiveRayTracer(scene, name, threads=1)
            spent, image = measure(
                partial(tracer.render, camera), budget_s=BUDGET_S, least=2
            )
            who = f"ART {name}"
            found[who] = panel(who, rgb_over_black(image.rgba), spent, truth)
        if SPLATS in self._peers:
            found |= self._splatted(scene, camera, truth)
        for who in self._volume:
            ask = self._volume_asker(who, scene, camera)
            found[who] = self._peer(who, ask, truth, truth)
        found[REFERENCE] = panel(REFERENCE, truth, timing, truth)
        return [found[who] for who in self.family.columns]

    def close(self) -> None:
        """End all peers and threads."""
        for peer in self._peers.values():
            peer.close()
        self._close_splats()

    def _close_splats(self) -> None:
        if self._splats is not None:
            self._splats.close()
        self._splats = None

    @property
    def _volume(self) -> list[str]:
        return [who for who in VOLUME_PEERS if who in self.family.columns]

    def _scene(self, head: str) -> Scene:
        """Return a head as the family shows it; forget what drew another."""
        scene = lit(gallery_scene(head))
        if self.family is SEE_THROUGH:
            scene = see_through(gallery_scene(head))
        if head != self._head:
            self._head, self._jobs = head, {}
            self._close_splats()
        return scene

    def _rays(self, scene: Scene, camera: Camera) -> Linear:
        tracer = ActiveRayTracer(scene, REFERENCE_QUALITY, threads=1)
        return rgb_over_black(tracer.render(camera).rgba)

    def _splatted(
        self, scene: Scene, camera: Camera, truth: Linear
    ) -> dict[str, Panel | Absent]:
        """Draw our splats in each mode, then let the peer draw them."""
        if self._splats is None:
            self._splats = FuzzySetRenderer(scene, threads=1)
        renderer = self._splats
        found: dict[str, Panel | Absent] = {}
        pictures: dict[str, Linear] = {}
        for mode in SplatMode:
            who = f"FSR {mode.value}"
            renderer.mode = mode
            timing, image = measure(
                lambda: renderer.render(camera), budget_s=BUDGET_S, least=2
            )
            pictures[who] = rgb_over_black(image.rgba)
            found[who] = panel(who, pictures[who], timing, truth)
        peer = self._peers[SPLATS]

        def ask() -> Answer:
            job = splat_job(peer, scene, renderer.fuzzy_set, camera, 0.0)
            # a frame takes a second, and one goes before it
            return peer.ask(job | {"least": 1})

        found[SPLATS] = self._peer(SPLATS, ask, truth, pictures[GAUSSIAN])
        return found

    def _volume_asker(
        self, who: str, scene: Scene, camera: Camera
    ) -> Callable[[], Answer]:
        peer = self._peers[who]

        def ask() -> Answer:
            if who not in self._jobs:
                self._jobs[who] = VolumeJobs(peer, scene)
            shaded = self.family is LIT
            return peer.ask(
                self._jobs[who].job(camera, STEP_VOXELS, shaded=shaded, budget_s=0.0)
            )

        return ask

    def _peer(
        self, who: str, ask: Callable[[], Answer], truth: Linear, own: Linear
    ) -> Panel | Absent:
        """Let a peer draw; check its picture before its time counts."""
        try:
            answer = ask()
        except UnavailableError as error:
            return Absent(who, str(error))
        bound = COARSE_RIGHT if who in COARSE else RIGHT
        picture = self._peers[who].picture(answer)
        return checked(who, picture, answer.timing, (truth, own), bound)


def lit(scene: Scene) -> Scene:
    """Return a scene with lights that all peers have."""
    return replace(scene, material=PhongMaterial(ambient=0.0, diffuse=1.2))


def see_through(scene: Scene) -> Scene:
    """Return a scene of thin tissue that shines by itself."""
    given = scene.transfer_function
    thin = TransferFunction(given.nodes, given.color, THINNING * given.kappa_per_mm)
    plain = PhongMaterial(ambient=1.0, diffuse=0.0)
    return replace(scene, lights=(), material=plain, transfer_function=thin)


def panel(who: str, linear: Linear, timing: Timing, truth: Linear) -> Panel:
    """Compare a picture with its reference."""
    pixels, right = encoded(linear), encoded(truth)
    error = image_error(linear, truth).rmse
    return Panel(who, pixels, timing.cpu_s, error, likeness(pixels, right))


def checked(
    who: str,
    linear: Linear,
    timing: Timing,
    right: tuple[Linear, Linear],
    bound: tuple[float, float],
) -> Panel:
    """Compare a peer's picture with its reference; its time counts if it is right.

    right: the reference, and ours of the same things, which may itself be off: a
    picture that is right beside either is right. bound: as `RIGHT`.
    """
    truth, own = right
    found = panel(who, linear, timing, truth)
    beside = panel(who, linear, timing, own)
    for seen in (found, beside):
        if seen.error <= bound[0] and seen.alike >= bound[1]:
            return found
    why = f"RMSE {beside.error:.3f} and SSIM {beside.alike:.3f} beside ours"
    return replace(found, cpu_s=None, why=why)
