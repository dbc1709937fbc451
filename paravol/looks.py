"""Pictures of a patient, without a flight: what ``import paravol`` draws."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, fields
from functools import cache, cached_property, partial, wraps
from typing import TYPE_CHECKING, Literal, ParamSpec

import numpy as np
from numpy.typing import NDArray

from paravol.patient import (
    PatientScene,
    Progress,
    load_case,
    load_phantom,
    load_scene,
    no_progress,
    thread_count,
)
from paravol.sessions.session_setup import LIVE_TIER
from paravol.snapshots.comparison import Difference, difference
from paravol.snapshots.rendering_service import running_worker
from paravol.snapshots.spool_folder import own_spool
from paravol.view import EndoscopeView
from renderers.art import ActiveRayTracer
from renderers.scene import Camera, Change, Mesh
from renderers.shading import Tier, meter
from renderers.snapshots.client import SnapshotClient
from scenarios import Endoscope, FrameState
from scenarios.instrument_state import FIRST_TOOL, NO_TOOL
from scenarios.instruments import instrument_named, placed_tool
from system import UserError

if TYPE_CHECKING:
    from renderers.fsr import SplatActor

P = ParamSpec("P")


@dataclass(frozen=True, slots=True)
class Look:
    """What the endoscope sees from one place.

    rgb: ``(h, w, 3)`` uint8 sRGB, row 0 at the top. depth_mm: ``(h, w)`` float32, along
    each pixel's ray, +inf where nothing is met. camera: its ``rays()`` give the rays,
    patient LPS, mm. gain: of the camera, for
    `Patient.look` to expose another picture alike. instrument_pose, instrument,
    jaw: as they were given.
    """

    rgb: NDArray[np.uint8]
    depth_mm: NDArray[np.float32]
    camera: Camera
    gain: float
    instrument_pose: NDArray[np.float64] | None = None
    instrument: str = FIRST_TOOL
    jaw: float = 1.0


@dataclass(frozen=True, slots=True)
class HighQualityPicture:
    """The ray tracer's best picture of a `Look`.

    rgb, depth_mm: as those of `Look`. seconds: it took. difference: of the look's
    picture from this one, in 8-bit codes.
    """

    rgb: NDArray[np.uint8]
    depth_mm: NDArray[np.float32]
    seconds: float
    difference: Difference


class Patient(PatientScene):
    """A patient that draws itself."""

    def look(
        self,
        place: NDArray[np.float64] | Camera,
        *,
        renderer: Literal["fsr", "art"] = "fsr",
        size: int = 512,
        gain: float | None = None,
        instrument_pose: NDArray[np.float64] | None = None,
        instrument: str = FIRST_TOOL,
        jaw: float = 1.0,
    ) -> Look:
        """Draw what the endoscope sees, lit and exposed as in the trainer.

        place: ``world_from_tip`` of a straight scope of 80 degrees, 4x4, or a camera of
        any place, lens and size; `Endoscope.camera` makes that of other scopes.
        renderer: "fsr" splats, as the live picture does; "art" casts rays. Both are
        shaded alike. size: of the square picture, pixels. gain: of the camera; None
        exposes automatically. instrument_pose: ``world_from_instrument`` of a tool,
        4x4; None for none. instrument: its name. jaw: 0 open to 1 closed. The first
        picture takes seconds longer: the scene is prepared for it.
        """
        camera = place
        if not isinstance(camera, Camera):
            camera = Endoscope().camera(np.asarray(place), 0.0, (size, size))
        view, tool = self._view, np.eye(4)
        if instrument_pose is not None:
            tool = np.asarray(instrument_pose)
        name = NO_TOOL if instrument_pose is None else instrument
        seen = FrameState(camera, np.eye(4), tool, 0.0, instrument=name, jaw=jaw)
        if renderer == "fsr":
            buffer = view.tissue(seen)
        elif renderer == "art":
            buffer = self._tracer.gbuffer(camera)
        else:
            raise UserError(f"the renderer is 'fsr' or 'art', got {renderer!r}")
        view.add_instrument(seen, buffer)
        radiance = view.light(seen, buffer)
        chosen = meter(radiance, buffer.material) if gain is None else gain
        pixels = view.expose(seen, buffer, radiance, gain=chosen, number=0)
        depth_mm = buffer.depth_mm
        return Look(pixels, depth_mm, camera, chosen, instrument_pose, instrument, jaw)

    def snapshot(
        self, look: Look, *, ranks: int = 1, progress: Progress = no_progress
    ) -> HighQualityPicture:
        """Have a look drawn again at high quality, by a worker process of its own.

        ranks: processes that share the work, over MPI where more than one. Takes from
        seconds to a minute. UserError when the worker cannot do it.
        """
        tools = []
        if look.instrument_pose is not None:
            tools = placed_tool(look.instrument, look.instrument_pose, look.jaw)
        with ExitStack() as stack:
            spool = stack.enter_context(own_spool())
            client = SnapshotClient(spool, name="paravol in Python")
            worker = stack.enter_context(running_worker(spool, ranks=ranks))
            request = client.request_scope(
                self.surface,
                look.camera,
                ring_radius_mm=Endoscope().ring_radius_mm,
                seed=self.detail_seed,
                gain=look.gain,
                instruments=tools,
            )
            job = client.submit(request)
            snapshot = client.wait(
                job, partial(progress, "Snapshot"), watch=worker.ensure_alive
            )
            pixels = snapshot.pixels()
            return HighQualityPicture(
                pixels,
                snapshot.depth_mm(),
                snapshot.result.seconds["total"],
                difference(look.rgb, pixels),
            )

    def update(self, change: Change) -> None:
        """Let later looks follow an edit of the scene's arrays in place."""
        # what no look has needed yet is made of the arrays as they are then
        if "_view" in self.__dict__:
            self._view.apply([change])
        if "_tracer" in self.__dict__:
            self._tracer.update(change)

    def splat_actor(self) -> "SplatActor":
        """Return the head as splats for a VTK or pyvista scene.

        Show it with ``actor.show_in(plotter.renderer)``, which keeps splats in order.
        """
        # it loads VTK
        from renderers.fsr import SplatActor, extract_fuzzy_set

        return SplatActor(extract_fuzzy_set(self.scene), self.scene)

    @cached_property
    def _view(self) -> EndoscopeView:
        return EndoscopeView(
            self,
            ring_radius_mm=Endoscope().ring_radius_mm,
            has_instrument=True,
            tier=Tier[LIVE_TIER],
            seed=self.detail_seed,
            threads=thread_count(),
            visible_sets=False,
        )

    @cached_property
    def _tracer(self) -> ActiveRayTracer:
        return ActiveRayTracer(self.scene, threads=thread_count())


def _drawn(load: Callable[P, PatientScene]) -> Callable[P, Patient]:
    """Let a function load a patient that draws itself."""

    @wraps(load)
    def loaded(*args: P.args, **kwargs: P.kwargs) -> Patient:
        found = load(*args, **kwargs)
        parts = {each.name: getattr(found, each.name) for each in fields(found)}
        return Patient(**parts)

    return loaded


load = _drawn(load_case)
phantom = _drawn(load_phantom)
scene = _drawn(load_scene)


@cache
def instrument(name: str = FIRST_TOOL, jaw: float = 1.0) -> Mesh:
    """Return an instrument's triangles, mm; +z of its frame runs back up the shaft.

    jaw: 0 open to 1 closed. UserError names the instruments there are.
    """
    return instrument_named(name).mesh(jaw)
