"""The parts of a session, built from its description or from its scenario."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from devices import ProbePath
from paravol.patient import OperatingRoom, Progress
from paravol.view import EndoscopeView
from renderers.shading import Tier
from scenarios import Sample, Scenario, Session, View, tip_frame

TOOL_AHEAD_MM, TOOL_ASIDE_MM = 12.0, 3.0
"""Where a tool is well in view."""


def build_session(
    scenario: Scenario,
    room: OperatingRoom,
    world_from_device: NDArray[np.float64],
    size: tuple[int, int],
) -> Session:
    """Start a session of the scenario under a registration, 4x4."""
    return Session(
        scenario.scope.endoscope(),
        world_from_device,
        room.surface.distance,
        room.positions(scenario.targets),
        size,
        room.structures,
    )


def build_view(
    scenario: Scenario,
    room: OperatingRoom,
    *,
    tier: str,
    seed: int,
    has_instrument: bool,
    threads: int,
    progress: Progress | None = None,
) -> EndoscopeView:
    """Set up the picture; seconds for a head that is seen for the first time."""
    # Imported here: building meshes loads a large library.
    from scenarios.instruments import suction_tube

    return EndoscopeView(
        room,
        ring_radius_mm=scenario.scope.ring_radius_mm,
        instrument=suction_tube() if has_instrument else None,
        tier=Tier[tier],
        seed=seed,
        threads=threads,
        progress=progress,
    )


def first_views(
    scenario: Scenario, room: OperatingRoom, path: ProbePath, size: tuple[int, int]
) -> list[View]:
    """Give views that need all that a session needs, to be drawn before it begins.

    From inside the nose, from before the nostril with its hairs, and with a tool in
    front of the lens.
    """
    inside = path_view(scenario, room, path, path.duration_s / 2, size)
    eye, right, _, forward = inside.camera.frame
    tip = eye + TOOL_AHEAD_MM * forward + TOOL_ASIDE_MM * right
    beside = replace(inside, world_from_instrument=tip_frame(tip, forward))
    return [inside, path_view(scenario, room, path, 0.0, size), beside]


def path_view(
    scenario: Scenario,
    room: OperatingRoom,
    path: ProbePath,
    time_s: float,
    size: tuple[int, int],
) -> View:
    """Give the view a scope on the path would have, without any arm."""
    at = path.sample(time_s)
    sample = Sample(
        time_s,
        tip_frame(at.tip_mm, at.axis),
        at.roll_deg,
        at.instrument_tip_mm,
        at.instrument_axis,
        at.buttons,
    )
    return build_session(scenario, room, np.eye(4), size).view(sample)
