"""The twelve views of the gallery: a nose at rest, in flight, and operated on."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from benchmarks import nasal_views
from benchmarks.nasal_views import NasalView, acceptance_views, path_views
from devices import Pose, ProbePath, load_probe_path
from paravol.inputs.instrument_controller import InstrumentController
from paravol.inputs.pose_completer import PATH_PEDAL, PathChannel
from paravol.inputs.scope_in_hand import ScopeInHand
from paravol.inputs.second_channel import SecondChannel
from paravol.patient import load_patient, no_progress
from paravol.sessions.session_setup import build_session, operate_on
from renderers.scene import Camera, Projection, Scene
from renderers.shading import ScopeLight
from scenarios import Endoscope, Sample, load_scenario, tip_frame

WOUNDED = "wounded"
"""The head after the bundled operation: no uncinate process, a wider ostium, blood."""

FLIGHT_VIEWS = 2
SCOPE_RESTS_S = 105.0
"""A time of the operation; its scope stays where it then is."""
NEARER_MM = 4.0
OSTIUM_MM = np.array((-13.5, 25.0, 25.2))
"""The right maxillary ostium of the default head, LPS."""
FRONT = "middle meatus"
"""The acceptance view that sees the wound from in front."""


def gallery_views(size: int) -> list[NasalView]:
    """Return them as square pictures of so many pixels."""
    healthy = acceptance_views(size)
    front = next(view for view in healthy if view.name == FRONT)
    scenario, folder = load_scenario("first_operation")
    path = load_probe_path(folder / scenario.path)
    scope = scenario.scope.endoscope()
    light = ScopeLight(scenario.scope.ring_radius_mm)
    at = path.sample(SCOPE_RESTS_S)
    nearer_mm = at.tip_mm + NEARER_MM * at.axis
    straight = replace(scope, angle_deg=0.0)
    wounds = {
        "wound": scope.camera(tip_frame(at.tip_mm, at.axis), at.roll_deg, (size, size)),
        "wound, nearer": scope.camera(
            tip_frame(nearer_mm, at.axis), at.roll_deg, (size, size)
        ),
        "wound, to the ostium": straight.camera(
            tip_frame(at.tip_mm, OSTIUM_MM - at.tip_mm), 0.0, (size, size)
        ),
    }
    return [
        *healthy,
        *path_views(size, FLIGHT_VIEWS),
        *(NasalView(name, WOUNDED, camera, light) for name, camera in wounds.items()),
        replace(front, name="wound, from in front", head=WOUNDED),
    ]


@cache
def gallery_scene(head: str) -> Scene:
    """Build a head of `NasalView.head`, or the wounded one."""
    return _wounded() if head == WOUNDED else nasal_views.nasal_scene(head)


def pinhole(camera: Camera) -> Camera:
    """Give the lens that peers have, in the same place."""
    return replace(camera, projection=Projection.PERSPECTIVE)


def operated_samples(path: ProbePath, endoscope: Endoscope) -> Iterator[Sample]:
    """Yield what a recording of a path without any arm would hold."""
    joiner = SecondChannel(
        PathChannel(path), ScopeInHand(), InstrumentController(endoscope)
    )
    for time_s in path.t_s.tolist():
        at = path.sample(time_s)
        frame = tip_frame(at.tip_mm, at.axis)
        yield joiner.join(Pose(time_s, time_s, frame, PATH_PEDAL))


def _wounded() -> Scene:
    """Operate as the bundled path does, to its end."""
    scenario, folder = load_scenario("first_operation")
    path = load_probe_path(folder / scenario.path)
    patient, operation = operate_on(load_patient(scenario, no_progress))
    session = build_session(scenario, patient, np.eye(4), (64, 64), operation)
    for sample in operated_samples(path, scenario.scope.endoscope()):
        session.step(sample)
    return patient.scene
