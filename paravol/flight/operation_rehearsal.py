"""Compile what an operation needs before it begins, on a piece of the head.

Without it the first bite of a machine that has never run the program would wait for the
compiler, for half a minute.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from anatomy.wall_layers import WallLayers
from paravol.inputs.pointed_tool import PointedTool
from paravol.patient import PatientScene, Progress
from paravol.sessions.session_setup import (
    LIVE_TIER,
    aimless,
    build_session,
    operate_on,
)
from paravol.view import EndoscopeView
from renderers.scene import AirSurface, Volume
from renderers.shading import Tier
from scenarios import InstrumentState, Sample, Scenario, tip_frame

STAGE = "Preparing the instruments"

SIDE = 40
"""Voxels of the piece, a side."""

VIEW_MM = 6.0
"""From the lens to what is cut."""

METAL_MM = np.array([2.2, 4.0, 0.0])
"""From the lens to a tool beside it that no wall hides."""

TOOLS = ("straight forceps", "microdebrider", "curette")
"""Of each kind of cut one."""


class Rehearsal:
    """Take the progress of what goes on beside, for whoever waits for it.

    staged: what is being done, and its done share.
    """

    def __init__(self, still: Callable[[], object]) -> None:
        """Begin; still: called with each step; what it raises ends the rehearsal."""
        self._still = still
        self.staged = STAGE, 0.0

    def __call__(self, stage: str, share: float) -> None:
        """Take a step."""
        self._still()
        self.staged = stage, share


def rehearse(
    scenario: Scenario,
    patient: PatientScene,
    progress: Progress,
    before_drawing: Callable[[], object] = bool,
    pointed: PointedTool | None = None,
) -> None:
    """Cut, bleed and draw a piece of a head; the head itself is left as it is.

    patient: as it was before anybody operated. before_drawing: called once, between
    what no renderer is needed for and the rest. pointed: shall be used.
    """
    progress(STAGE, 0.0)
    piece, place = _piece(patient)
    operated, operation = operate_on(piece)
    session = build_session(aimless(scenario), operated, np.eye(4), (64, 64), operation)
    forward = np.array([0.0, 1.0, 0.0])
    scope = tip_frame(place - VIEW_MM * forward, forward)
    steps = [(tool, jaw) for tool in TOOLS for jaw in (0.0, 1.0, 1.0)]
    samples = []
    for number, (tool, jaw) in enumerate(2 * steps):
        works = jaw > 0.0
        carried = number % 2 == 1
        state = InstrumentState(tool, 0.0, jaw, works, works, is_carried=carried)
        tip = place + 0.1 * number * forward
        samples.append(Sample(0.2 * number, scope, 0.0, tip, forward, 0, state))
    for number, sample in enumerate(samples[: len(steps)]):
        session.step(sample)
        progress(STAGE, number / len(samples))
    operation.take_changes()
    if pointed is not None:
        pointed.warm_up(InstrumentState(TOOLS[0]), scope)
    before_drawing()
    view = EndoscopeView(
        operated,
        ring_radius_mm=scenario.scope.ring_radius_mm,
        has_instrument=True,
        tier=Tier[LIVE_TIER],
        seed=operated.detail_seed,
        threads=1,
    )
    for number, sample in enumerate(samples[len(steps) :]):
        session.step(sample)
        view.apply(operation.take_changes())
        if number % 3 == 1:
            view.draw(session.view(sample), number=number, elapsed_s=0.1)
        progress(STAGE, (len(steps) + number) / len(samples))
    # wherever walls lie in this head: metal before the lens, in what air there is
    distance = operated.surface.distance
    deepest = np.unravel_index(int(np.argmin(distance.values)), distance.shape)
    clear = (distance.world_from_voxel @ np.array([*deepest[::-1], 1.0]))[:3]
    state = InstrumentState(TOOLS[0], 0.0, 1.0)
    last_s, tip = samples[-1].time_s + 0.2, clear + METAL_MM
    metal = Sample(last_s, tip_frame(clear, forward), 0.0, tip, forward, 0, state)
    view.draw(session.view(metal), number=len(samples), elapsed_s=0.1)
    operation.patient.warm_up()
    change = operation.patient.undo()
    if change is not None:
        view.apply([operation.pushing.follow(change)])
    view.renderer.close()


def _piece(patient: PatientScene) -> tuple[PatientScene, NDArray[np.float64]]:
    """Return a cube of the head around a wall, and a place on that wall, LPS mm."""
    distance = patient.surface.distance
    middle = np.array(distance.shape) // 2
    low = np.maximum(middle - SIDE // 2, 0)
    high = np.minimum(low + SIDE, distance.shape)
    best = np.inf
    # the cube that has a wall in its middle, among those along the head's axis
    for shift in range(-2 * SIDE, 2 * SIDE, SIDE // 4):
        at = middle + np.array([0, shift, 0])
        at = np.clip(at, 0, np.array(distance.shape) - 1)
        off = abs(float(distance.values[tuple(at)]))
        if off < best:
            best = off
            low = np.clip(at - SIDE // 2, 0, np.array(distance.shape) - 2)
            high = np.minimum(low + SIDE, distance.shape)

    def cut(volume: Volume) -> Volume:
        here = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        first = volume.world_from_voxel @ np.array([*low[::-1], 1.0])
        values = volume.values[here].copy()
        # for arrays that may not be written kernels are compiled anew
        values.flags.writeable = volume.values.flags.writeable
        return Volume(
            values,
            volume.spacing_mm,
            first[:3],
            volume.direction,
            volume.background,
        )

    surface = patient.surface
    scene = replace(
        patient.scene,
        volume=cut(patient.scene.volume),
        surface=AirSurface(
            cut(surface.distance), cut(surface.blood), cut(surface.skin)
        ),
    )
    assert scene.surface is not None
    values = scene.surface.distance.values
    inner = values[4:-4, 4:-4, 4:-4]
    k, j, i = np.unravel_index(np.argmin(np.abs(inner)), inner.shape)
    matrix = scene.surface.distance.world_from_voxel
    place = (matrix @ np.array([i + 4, j + 4, k + 4, 1.0]))[:3]
    layers, hazards, structures = patient.layers, patient.hazards, patient.structures
    if layers is not None:
        wall, ground = cut(layers.wall), cut(layers.ground)
        layers = WallLayers(
            wall, ground, layers.kinds, layers.source, layers.uncertainty_mm
        )
    if hazards is not None:
        volumes = {name: cut(volume) for name, volume in hazards.volumes.items()}
        hazards = HazardVolumes(volumes, hazards.source)
    if structures is not None:
        structures = replace(
            structures,
            distance=scene.surface.distance,
            labels=cut(structures.labels),
            landmarks={},
        )
    piece = replace(
        patient, scene=scene, structures=structures, layers=layers, hazards=hazards
    )
    return piece, place
