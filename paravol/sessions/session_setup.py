"""The parts of a session, built from its description or from its scenario."""

import datetime
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np
import xxhash
from numpy.typing import NDArray

from devices import ProbePath, Registration
from paravol.exercises.exercise_path import recorded_path
from paravol.patient import PatientScene, Progress
from paravol.versions import versions
from paravol.view import EndoscopeView
from renderers.scene import Volume
from renderers.shading import LOOK_VERSION, Tier
from scenarios import (
    Endoscope,
    FrameState,
    Sample,
    Scenario,
    Session,
    Structures,
    load_scenario,
    tip_frame,
)
from scenarios.bundle import SessionInfo
from scenarios.coverage import CoverageWatch, Mucosa, mucosa_of
from scenarios.nostril import Nostrils
from scenarios.operation import Operation
from scenarios.tasks import TaskEngine
from scenarios.tasks.head_parts import Head
from surgery.patient import OperatedPatient
from system import UserError

OnePatient = TypeVar("OnePatient", bound=PatientScene)

LIVE_TIER = "FLIGHT"

TOOL_AHEAD_MM, TOOL_ASIDE_MM = 12.0, 3.0
"""Where a tool is well in view."""


def describe_session(
    scenario: Scenario,
    patient: PatientScene,
    registration: Registration,
    *,
    size: int,
    has_instrument: bool,
) -> SessionInfo:
    """Gather what a replay needs to know."""
    return SessionInfo(
        scenario_name=scenario.name,
        scenario=msgspec.json.encode(scenario).decode(),
        picture_size=(size, size),
        tier=LIVE_TIER,
        seed=patient.detail_seed,
        world_from_device=registration.world_from_device.ravel().tolist(),
        registration_rms_mm=registration.residual_rms_mm,
        surface_sha256=patient.surface_sha256,
        has_instrument=has_instrument,
        created=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        versions=versions(),
        look=LOOK_VERSION,
        structures_sha256=""
        if patient.structures is None
        else patient.structures.sha256(),
        visible_sets=False,
        operated=True,
        hazards_sha256=patient.hazards_sha256,
    )


SIDES = ("right", "left")


def operate_on(patient: OnePatient) -> tuple[OnePatient, Operation]:
    """Return the patient as it is operated on, and what edits it.

    The scene's distance, CT and wounds are edited in place; the given patient stays as
    it is. The scene's surface is what is seen, bent by tools; what is measured is that
    of `Operation.patient`, at rest.
    """
    labels = None if patient.structures is None else patient.structures.labels
    operated = OperatedPatient(
        patient.surface, patient.layers, labels, patient.scene.volume
    )
    assert operated.ct is not None
    operation = Operation.on(operated, labels, patient.hazards, patient.blood_bias)
    shown = operation.pushing.surface
    scene = replace(patient.scene, volume=operated.ct, surface=shown)
    structures = patient.structures
    if structures is not None:
        structures = replace(structures, distance=operated.surface.distance)
    return replace(patient, scene=scene, structures=structures), operation


class MissingCaseError(UserError):
    """The case that a session was flown through is not where it was."""


def flown_scenario(folder: Path, info: SessionInfo, case: Path | None) -> Scenario:
    """Return what was flown; MissingCaseError where its case is not there.

    folder: its name, for what is refused. case: where the case lies now.
    """
    scenario = info.exercise()
    if case is not None:
        head = msgspec.structs.replace(scenario.head, case=str(case))
        scenario = msgspec.structs.replace(scenario, head=head)
    if scenario.head.case and not Path(scenario.head.case).is_dir():
        raise MissingCaseError(
            f"{folder} was flown through the case {scenario.head.case}, which is not "
            "there; say with --case where it lies now."
        )
    return scenario


def reopen_session(
    folder: Path,
    info: SessionInfo,
    patient: PatientScene,
    size: tuple[int, int] | None = None,
) -> tuple[PatientScene, Session]:
    """Return a recorded flight's patient and session as they were before it.

    folder: its name, for what is refused. patient: as before anybody operated; the one
    returned is operated on where that one was. size: of the picture; None as recorded.
    UserError for another head than was flown through.
    """
    if patient.surface_sha256 != info.surface_sha256:
        raise UserError(
            f"{folder} was flown through another head (surface "
            f"{info.surface_sha256[:12]}, now {patient.surface_sha256[:12]}): this "
            "version of the program builds it differently, so the pictures cannot "
            "match."
        )
    operation = None
    if info.operated:
        patient, operation = operate_on(patient)
    scenario = info.exercise()
    matrix = np.array(info.world_from_device).reshape(4, 4)
    size = size or info.picture_size
    return patient, build_session(scenario, patient, matrix, size, operation)


def build_session(
    scenario: Scenario,
    patient: PatientScene,
    world_from_device: NDArray[np.float64],
    size: tuple[int, int],
    operation: Operation | None = None,
) -> Session:
    """Start a session of the scenario under a registration, 4x4.

    operation: what the second hand does to the patient; see `operate_on`. Where there
    is one, or there are tasks, what mucosa is seen is watched. Whether the exercise
    fits the head is asked before, see `paravol.exercises.exercise_fit`.
    """
    surface = patient.surface if operation is None else operation.patient.surface
    tasks = None
    if scenario.tasks:
        tasks = TaskEngine(
            scenario.tasks, patient.landmarks, untouched(patient, operation)
        )
    watch = coverage_watch(patient, operation) if tasks or operation else None
    return Session(
        scenario.scope.endoscope(),
        world_from_device,
        surface.distance,
        patient.positions(scenario.targets),
        size,
        patient.structures,
        operation,
        patient.hazards,
        tasks,
        nostrils(patient),
        watch,
    )


def untouched(patient: PatientScene, operation: Operation | None = None) -> Head:
    """Return a patient's head as before any cut, for what measures tasks by it."""
    distance = patient.surface.distance
    if operation is not None:
        distance = operation.patient.pristine.distance
    return Head(distance, patient.structures)


def aimless(scenario: Scenario) -> Scenario:
    """Return the exercise's scope alone: for what looks or cuts, and asks nothing."""
    return Scenario(scenario.name, scenario.title, scope=scenario.scope)


def coverage_watch(
    patient: PatientScene, operation: Operation | None = None
) -> CoverageWatch:
    """Begin to watch what is seen of a patient's mucosa, as it was before any cut.

    The first look loads compiled code, so one is made here: no flight waits for it.
    """
    distance = untouched(patient, operation).distance
    digest = xxhash.xxh3_128(distance.values.data)
    digest.update(distance.world_from_voxel.tobytes())
    known = digest.hexdigest(), patient.structures_sha256
    head = _Head(known, distance, patient.structures)
    mucosa = _divided(head)
    camera = Endoscope().camera(np.eye(4), 0.0, (8, 8))
    CoverageWatch(mucosa).step(0.0, camera, distance)
    return CoverageWatch(mucosa, patient.landmarks)


@dataclass(frozen=True, slots=True)
class _Head:
    """A head's surface and names, told apart by their hashes."""

    known: tuple[str, str]
    distance: Volume = field(compare=False)
    structures: Structures | None = field(compare=False)


@lru_cache(maxsize=2)
def _divided(head: _Head) -> Mucosa:
    """Return a head's patches; kept of a head, and of the piece rehearsed on."""
    return mucosa_of(head.distance, head.structures)


def nostrils(patient: PatientScene) -> Nostrils | None:
    """Return what a patient's shafts pass through; None where nobody knows."""
    if patient.way_in is not None:
        way = patient.way_in
        return Nostrils.of(np.array([way.pivot_mm]), np.array([way.axis]))
    places = patient.landmarks
    ways = [(f"nostril, {s}", f"sphenoethmoidal recess, {s}") for s in SIDES]
    known = [(a, b) for a, b in ways if a in places and b in places]
    if not known:
        return None
    middles = np.array([places[a] for a, _ in known])
    return Nostrils.of(middles, np.array([places[b] for _, b in known]) - middles)


def build_view(
    scenario: Scenario,
    patient: PatientScene,
    *,
    threads: int,
    tier: str = LIVE_TIER,
    seed: int | None = None,
    has_instrument: bool = True,
    progress: Progress | None = None,
    visible_sets: bool = False,
) -> EndoscopeView:
    """Set up the picture, a flight's where nothing else is said.

    With visible sets it takes 20 s for a head that is new.

    seed: of the tissue's fine detail, None for the patient's own.
    has_instrument, visible_sets: see `EndoscopeView`.
    """
    return EndoscopeView(
        patient,
        ring_radius_mm=scenario.scope.ring_radius_mm,
        has_instrument=has_instrument,
        tier=Tier[tier],
        seed=patient.detail_seed if seed is None else seed,
        threads=threads,
        progress=progress,
        visible_sets=visible_sets,
    )


def first_views(
    scenario: Scenario, patient: PatientScene, path: ProbePath, size: tuple[int, int]
) -> list[FrameState]:
    """Return views that need all that a session needs, to be drawn before it begins.

    From inside the nose, from before the nostril with its hairs, and with a tool in
    front of the lens.
    """
    inside = path_view(scenario, patient, path, path.duration_s / 2, size)
    eye, right, _, forward = inside.camera.frame
    tip = eye + TOOL_AHEAD_MM * forward + TOOL_ASIDE_MM * right
    beside = replace(inside, world_from_instrument=tip_frame(tip, forward))
    return [inside, path_view(scenario, patient, path, 0.0, size), beside]


def path_view(
    scenario: Scenario,
    patient: PatientScene,
    path: ProbePath,
    time_s: float,
    size: tuple[int, int],
) -> FrameState:
    """Return the view a scope on the path would have, without any arm."""
    at = path.sample(time_s)
    sample = Sample(
        time_s,
        tip_frame(at.tip_mm, at.axis),
        at.roll_deg,
        at.instrument_tip_mm,
        at.instrument_axis,
        at.buttons,
    )
    return build_session(aimless(scenario), patient, np.eye(4), size).view(sample)


def flight_pose(
    time_s: float, scenario: str = "first_flight"
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where a scenario's recorded path has the scope and the suction tube.

    time_s: seconds from the path's beginning, held within it. scenario: a bundled name
    or a ``.toml`` file. Return ``world_from_tip`` and ``world_from_instrument``, 4x4;
    they belong to the scenario's own patient, ``phantom(average=True)`` for the bundled
    one.
    """
    described, folder = load_scenario(scenario)
    at = recorded_path(described, folder).sample(time_s)
    instrument_pose = tip_frame(at.instrument_tip_mm, at.instrument_axis)
    return tip_frame(at.tip_mm, at.axis), instrument_pose
