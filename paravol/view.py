"""The endoscope's picture: tissue by splats, instruments by rays, one light for all."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from xxhash import xxh3_128_hexdigest

from paravol.patient import PatientScene, Progress, no_progress
from renderers.fsr import FuzzySetRenderer
from renderers.scene import Camera, Change, GBuffer, Material
from renderers.scene.change import merged
from renderers.scene.lens_state import CLEAN, LensState, all_over
from renderers.scene.mesh import PlacedMesh
from renderers.scene.mesh_drawing import ListedFacets
from renderers.scene.thread_pool import Future, ThreadPool
from renderers.shading import (
    AutoGain,
    CameraPass,
    Caster,
    ScopeLight,
    ScopeShader,
    Tier,
    meter,
)
from renderers.shading.bands import RowBands
from renderers.shading.half_light import HALF_FROM_PX
from renderers.shading.shader import Lattice
from scenarios import FrameState
from scenarios.instruments import INSTRUMENTS, placed_tool

VISIBLE_SETS_STAGE = "Finding what can be seen from where"


@dataclass(frozen=True, slots=True)
class Frame:
    """One finished picture.

    pixels: ``(h, w, 3)`` uint8 sRGB.
    gain: the camera gain it was made with. lens: what lay on the front lens.
    """

    pixels: NDArray[np.uint8]
    gbuffer: GBuffer
    gain: float
    lens: LensState = CLEAN

    def fingerprint(self) -> str:
        """Hash the picture's bytes: 32 hexadecimal digits.

        It is not cryptographic. XXH3 takes 0.01 ms for
        512 x 512 pixels where BLAKE2b takes 1.
        """
        return xxh3_128_hexdigest(self.pixels.data)


class EndoscopeView:
    """Draw views of one head, one after the other."""

    def __init__(
        self,
        patient: PatientScene,
        *,
        ring_radius_mm: float,
        has_instrument: bool,
        tier: Tier,
        seed: int,
        threads: int,
        progress: Progress | None = None,
        visible_sets: bool = False,
    ) -> None:
        """Extract the fuzzy set, set up the light.

        has_instrument: show the tool that a view has beside the scope. visible_sets:
        look up what can be seen from where in place of tracing cones every frame: the
        same pictures but for pinholes, see `FuzzySetRenderer.use_visible_sets`.
        """
        # one pool for all stages: its threads are still awake when the next begins
        self._pool = pool = ThreadPool(threads)
        self.renderer = FuzzySetRenderer(patient.scene, threads=pool)
        report = progress or no_progress
        if visible_sets:
            report(VISIBLE_SETS_STAGE, 0.0)
            self.renderer.use_visible_sets(progress=partial(report, VISIBLE_SETS_STAGE))
        self._shader = ScopeShader(patient.surface, tier, seed=seed, threads=pool)
        self._camera_pass = CameraPass(threads=pool)
        self._begun: Future[Frame] | None = None
        self._light = ScopeLight(ring_radius_mm)
        self.has_instrument = has_instrument
        self._auto_gain = AutoGain()
        # few parts, since each looks through all groups of triangles, but not so few
        # that one of them has the whole tool
        self._bands = RowBands(pool, bands_per_thread=4)
        self._lit: tuple[object, GBuffer, NDArray[np.float32]] | None = None
        self.lens = CLEAN
        """What lies on the front lens in the next picture."""
        self.props: tuple[PlacedMesh, ...] = ()
        """What else stands in the scene in the next picture."""
        self.generation = 0
        """Of the tissue that the next picture shows; see `Change`."""
        self.views_skipped = 0
        """Frames whose view was the one before, so that they were only exposed."""

    def warm_up(self, views: Sequence[FrameState], progress: Progress) -> None:
        """Compile every kernel and fill every table by drawing `views` once.

        Without it the first frame of a session would take a minute on a machine that
        has never run the program, and so would the first that shows a tool. Leaves no
        trace in later pictures. See `first_views`.
        """
        stage = "Preparing the renderers"
        for n, view in enumerate(views):
            # the first view takes the longest by far
            progress(stage, 0.8 * min(n, 1) + 0.1 * max(n - 1, 0))
            buffer = self.gbuffer(view)
            radiance = self.light(view, buffer)
            gain = meter(radiance, buffer.material)
            self.expose(view, buffer, radiance, gain=gain, number=0)
        # a picture that grows in flight is lit at half its size; nothing is seen in it
        large = (HALF_FROM_PX, HALF_FROM_PX)
        camera = view.camera.with_size(*large)
        self.light(replace(view, camera=camera), GBuffer.empty(*large).read_only())
        # a tool at the lens, and all that gets on it
        buffer.material[:] = Material.METAL
        buffer.depth_mm[:] = 1.0
        self.lens = LensState(all_over(0.5), all_over(0.5), 0.5, 0.5)
        self.expose(view, buffer, radiance, gain=gain, number=0)
        self.lens = CLEAN
        progress(stage, 1.0)

    @staticmethod
    def prepare_tools(is_over: Callable[[], bool]) -> None:
        """Cut the tools that no view has shown; beside the flight's first frames.

        One that is taken up in flight must not stop it for a tenth of a second.
        is_over: asked before each tool. It may take its time, which is the frames':
        much of this keeps the interpreter.
        """
        for tool in INSTRUMENTS.values():
            if is_over():
                return
            for mesh, pose in tool.placed(np.eye(4), 1.0):
                mesh.facets()
                mesh.spine(pose)

    def prepare(self, camera: Camera) -> None:
        """Make the tables of a lens and a picture size; beside a frame in work.

        They take up to half a second and are kept: the first picture of the size then
        takes not much longer than the second.
        """
        camera.lens_table()
        self._camera_pass.prepare(camera)

    def apply(self, changes: Sequence[Change]) -> None:
        """Bring everything derived from the patient up to date, before a frame begins.

        changes: edits that were made in the scene's arrays since the last call.
        """
        # a slow frame brings many, most of them round the tool
        updates = [self.renderer.update, *self._shader.updates]
        for change in merged(changes):
            parts = [partial(update, change) for update in updates]
            self._pool.map(lambda part: part(), parts)
            self.generation = change.generation

    def gbuffer(self, view: FrameState) -> GBuffer:
        """Find what each pixel shows, the instrument in front of or behind tissue."""
        buffer = self.tissue(view)
        self.add_instrument(view, buffer)
        return buffer

    def tissue(self, view: FrameState) -> GBuffer:
        """Find the tissue that each pixel shows: the first stage of a frame."""
        return self.renderer.gbuffer(view.camera)

    def add_instrument(
        self,
        view: FrameState,
        buffer: GBuffer,
        listed: Sequence[ListedFacets] | None = None,
    ) -> None:
        """Draw the instrument where it is nearer: the second stage.

        listed: what of its parts may be in view, where that is known.
        """
        for part in self._listed(view) if listed is None else listed:
            part.draw(buffer, self._bands.run)

    def light(
        self, view: FrameState, buffer: GBuffer, lattice: Lattice | None = None
    ) -> NDArray[np.float32]:
        """Return linear radiance ``(h, w, 3)``: the third stage.

        lattice: of the view, where that is known.
        """
        lattice = lattice or self._lattice(view)
        return self._shader.shade(buffer, view.camera, self._light, lattice=lattice)

    def expose(
        self,
        view: FrameState,
        buffer: GBuffer,
        radiance: NDArray[np.float32],
        *,
        gain: float,
        number: int,
    ) -> NDArray[np.uint8]:
        """Take the picture: the fourth stage."""
        pixels, _ = self._camera_pass.finish(
            radiance,
            buffer,
            view.camera,
            gain=gain,
            frame_number=number,
            lens=self.lens,
        )
        return pixels

    def begin(
        self,
        view: FrameState,
        *,
        number: int,
        elapsed_s: float,
        gain: float | None = None,
        then: Callable[[Frame], None] | None = None,
    ) -> Future[Frame]:
        """Draw a frame but for the end of it, which is left to one of the threads.

        number: seeds the sensor noise.
        elapsed_s: time since the last frame; the automatic gain follows with it.
        gain: a fixed gain instead, for replays.
        then: called with the finished frame, in the thread that finished it. Frames
        are finished in the order in which they were begun.
        While one thread develops the picture the next view may be begun, where at
        first there is work for one thread only. The first error of a frame, or of what
        is called with it, is raised by its result and by the next call. A scope that
        rests is only exposed anew: the same bits as drawn again.
        """
        seen = (
            view.camera.key,
            view.world_from_instrument.tobytes(),
            view.instrument,
            view.jaw,
            self.generation,
            tuple((id(mesh), pose.tobytes()) for mesh, pose in self.props),
        )
        if self._lit is None or self._lit[0] != seen:
            # what the camera alone decides: between stages one thread would find it
            # while the others wait; now they still develop the picture before
            listed, lattice = self._listed(view), self._lattice(view)
            buffer = self.tissue(view)
            self.add_instrument(view, buffer, listed)
            self._lit = seen, buffer, self.light(view, buffer, lattice)
        else:
            self.views_skipped += 1
        _, buffer, radiance = self._lit

        self.settle()
        chosen, lens = gain, self.lens
        if chosen is None:
            chosen = self._auto_gain.follow(meter(radiance, buffer.material), elapsed_s)

        def finish(pixels: NDArray[np.uint8]) -> Frame:
            frame = Frame(pixels, buffer, chosen, lens)
            if then is not None:
                then(frame)
            return frame

        self._begun = self._camera_pass.begin(
            radiance,
            buffer,
            view.camera,
            gain=chosen,
            frame_number=number,
            then=finish,
            lens=lens,
        )
        return self._begun

    def _tool(self, view: FrameState) -> list[PlacedMesh]:
        """Return the parts of the view's tool, and what else stands in the scene."""
        if not self.has_instrument:
            return [*self.props]
        tool = placed_tool(view.instrument, view.world_from_instrument, view.jaw)
        return [*tool, *self.props]

    def _listed(self, view: FrameState) -> list[ListedFacets]:
        """List what of the instrument's parts may be in view."""
        return [mesh.listed(view.camera, pose) for mesh, pose in self._tool(view)]

    def _lattice(self, view: FrameState) -> Lattice:
        """Find what light and shadows need to know of a view before its pixels."""
        casters = [Caster.of(mesh, pose) for mesh, pose in self._tool(view)]
        size = view.camera.height, view.camera.width
        return self._shader.lattice(size, view.camera, self._light, casters)

    def settle(self) -> None:
        """Wait until nothing is in the making; its error is raised, once."""
        begun, self._begun = self._begun, None
        if begun is not None:
            begun.result()

    def draw(
        self,
        view: FrameState,
        *,
        number: int,
        elapsed_s: float,
        gain: float | None = None,
    ) -> Frame:
        """Draw one frame and wait for it; see `begin`."""
        begun = self.begin(view, number=number, elapsed_s=elapsed_s, gain=gain)
        self.settle()
        return begun.result()
