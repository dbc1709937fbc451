"""An exercise from a recorded session: its way as hoops and stops, and as a path."""

import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from devices import ProbePath, save_probe_path
from paravol.inputs.pose_completer import PATH_SUCTION, PATH_WORK
from paravol.patient import PatientScene, Progress, load_patient, no_progress
from paravol.sessions.session_setup import build_session, flown_scenario
from scenarios import Sample, Scenario
from scenarios.bundle import read_recording
from scenarios.instrument_state import NO_TOOL
from scenarios.path_course import course_tasks, score_clock_s
from scenarios.tasks.engine import Status
from scenarios.tasks.task import Follow, Reach
from system import UserError, whole_file

_CHECK_PX = (64, 64)
"""Of a picture that nobody draws."""


@dataclass(frozen=True, slots=True)
class AuthoredScenario:
    """What was written: the files, and how many hoops and stops there are."""

    file: Path
    path_file: Path
    hoops: int
    stops: int
    duration_s: float


def scenario_from_session(
    folder: Path,
    out: Path,
    *,
    name: str = "",
    title: str = "",
    case: Path | None = None,
    patient: PatientScene | None = None,
    progress: Progress = no_progress,
) -> AuthoredScenario:
    """Write a scenario and its path file from a recorded session.

    out: folder for both. name: of the files and the exercise; "" takes the folder's.
    case: where the case that was flown through lies now. patient: the one that was
    flown through, where it is loaded. The new tasks are tried with the recording:
    UserError where it does not pass them, where it holds no way, or where a file of
    that name is there.
    """
    recording = read_recording(folder)
    samples = [record.sample() for record in recording.samples]
    if len(samples) < 2:
        raise UserError(f"{folder} holds no way; nothing was recorded.")
    flown = flown_scenario(folder, recording.info, case)
    name = name or re.sub(r"\W+", "_", folder.absolute().stem).strip("_").lower()
    if not re.fullmatch(r"\w+", name):
        raise UserError(f"--name must be one word, got {name!r}.")
    file, path_file = out / f"{name}.toml", out / f"{name}.path.json"
    for there in (file, path_file):
        if there.exists():
            raise UserError(f"{there} is there already; choose another --name.")
    patient = patient or load_patient(flown, progress)
    if patient.surface_sha256 != recording.info.surface_sha256:
        raise UserError(
            f"{folder} was flown through another head than its scenario names now; "
            "hoops would stand in its walls."
        )
    world_from_device = np.array(recording.info.world_from_device).reshape(4, 4)
    source = f"the recording {folder.absolute().name}"
    path = path_of(name, source, samples, world_from_device)
    tasks = course_tasks(path.t_s, path.tip_mm, patient.surface.distance)
    scenario = Scenario(
        name=name,
        title=title or f"{flown.title}, as it was flown",
        path=path_file.name,
        head=flown.head,
        scope=flown.scope,
        fiducials=flown.fiducials,
        targets=flown.targets,
        tasks=tasks,
    )
    _try(scenario, patient, samples, world_from_device, progress)
    out.mkdir(parents=True, exist_ok=True)
    save_probe_path(path, path_file)
    with whole_file(file) as beside:
        beside.write_text(scenario_toml(scenario, out), "utf-8")
    hoops = sum(len(task.rings) for task in tasks if isinstance(task, Follow))
    stops = sum(isinstance(task, Reach) for task in tasks)
    return AuthoredScenario(file, path_file, hoops, stops, path.duration_s)


def scenario_toml(scenario: Scenario, folder: Path) -> str:
    """Return a scenario as a file of a folder, for people to go on with.

    Whatever is as usual is left out. A case is named from the folder.
    """
    if scenario.head.case:
        case = os.path.relpath(scenario.head.case, folder.absolute())
        head = msgspec.structs.replace(scenario.head, case=case)
        scenario = msgspec.structs.replace(scenario, head=head)
    told = _unusual(scenario)
    tables = {key: told.pop(key) for key in [*told] if isinstance(told[key], dict)}
    rows = told.pop("tasks", [])
    lines = [f"{key} = {_toml(value)}" for key, value in told.items()]
    for key, table in tables.items():
        lines += ["", f"[{key}]", *(f"{k} = {_toml(v)}" for k, v in table.items())]
    for row in rows:
        lines += ["", "[[tasks]]", *(f"{k} = {_toml(v)}" for k, v in row.items())]
    return "\n".join(lines) + "\n"


def path_of(
    name: str,
    source: str,
    samples: Sequence[Sample],
    world_from_device: NDArray[np.float64],
) -> ProbePath:
    """Return what hands did as a path, without what was frozen.

    world_from_device: 4x4, of the samples' scope. UserError where nothing moves.
    """
    time_s = np.array([sample.time_s for sample in samples])
    is_frozen = np.array([sample.is_frozen for sample in samples])
    clock_s = score_clock_s(time_s, is_frozen)
    # a path's times rise: of samples at one time the last is kept
    rises = np.concatenate([np.diff(clock_s) > 0.0, [True]]) & ~is_frozen
    places = np.flatnonzero(rises).tolist()
    if len(places) < 2:
        raise UserError(f"{source} holds no way: it was frozen all the time.")
    kept = [samples[place] for place in places]
    frames = np.array([world_from_device @ sample.device_from_tip for sample in kept])
    axis = -frames[:, :3, 2]
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    tool_tip = np.array([sample.instrument_tip_mm for sample in kept])
    tool_axis = np.array([sample.instrument_pointing for sample in kept])
    lengths = np.linalg.norm(tool_axis, axis=1)
    is_there = np.isfinite(tool_tip).all(axis=1) & (lengths > 0.5)
    # no tool was held there: it lies behind the lens
    tool_tip = np.where(is_there[:, None], tool_tip, frames[:, :3, 3] - 60.0 * axis)
    lengths = np.where(is_there, lengths, 1.0)
    tool_axis = np.where(is_there[:, None], tool_axis / lengths[:, None], axis)
    roll = np.rad2deg(np.unwrap(np.deg2rad([sample.roll_deg for sample in kept])))
    times = clock_s[places] - clock_s[places[0]]
    tools: list[tuple[float, str]] = []
    scopes: list[tuple[float, float | None]] = []
    for at_s, sample in zip(times.tolist(), kept, strict=True):
        held = sample.instrument.name
        if (tools[-1][1] if tools else NO_TOOL) != held:
            tools.append((at_s, held))
        if (scopes[-1][1] if scopes else None) != sample.scope_deg:
            scopes.append((at_s, sample.scope_deg))
    hand = [sample.instrument for sample in kept]
    buttons = [
        sample.buttons & 127
        | PATH_WORK * state.is_working
        | PATH_SUCTION * state.is_sucking
        for sample, state in zip(kept, hand, strict=True)
    ]
    # between two tools a turn goes on evenly
    held_at = np.flatnonzero([state.name != NO_TOOL for state in hand])
    turn = np.zeros(len(hand))
    if len(held_at):
        turns = np.deg2rad([hand[n].roll_deg for n in held_at])
        every = np.arange(len(hand))
        turn = np.interp(every, held_at, np.rad2deg(np.unwrap(turns)))
    return ProbePath(
        name,
        times,
        frames[:, :3, 3],
        axis,
        roll,
        tool_tip,
        tool_axis,
        np.array(buttons, np.int64),
        source,
        tuple(tools),
        turn,
        np.array([state.jaw for state in hand]),
        tuple(scopes),
    )


def _try(
    scenario: Scenario,
    patient: PatientScene,
    samples: list[Sample],
    world_from_device: NDArray[np.float64],
    progress: Progress,
) -> None:
    """Raise UserError unless the samples pass the scenario's tasks."""
    session = build_session(scenario, patient, world_from_device, _CHECK_PX)
    assert session.tasks is not None
    for number, sample in enumerate(samples):
        session.step(sample)
        progress("Trying the course", (number + 1) / len(samples))
    missed = [s.name for s in session.tasks.ended() if s.status is not Status.DONE]
    if missed:
        raise UserError(
            f"The recording does not pass the task {missed[0]!r} made from it: too "
            "much of the way is missing. Record it again."
        )


def _unusual(struct: msgspec.Struct) -> dict[str, Any]:
    """Return a struct's fields that are not as usual, by their names in a file."""
    told: dict[str, Any] = {}
    tag = struct.__struct_config__.tag
    if tag is not None:
        told["kind"] = tag
    for field in msgspec.structs.fields(struct):
        value = getattr(struct, field.name)
        if field.required or value != field.default:
            told[field.encode_name] = _plain(value)
    # what a person looks for first
    head = [key for key in ("kind", "name", "title") if key in told]
    return {key: told[key] for key in [*head, *told] if told[key] != {}}


def _plain(value: Any) -> Any:
    if isinstance(value, msgspec.Struct):
        return _unusual(value)
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    return msgspec.to_builtins(value)


def _toml(value: Any) -> str:
    """Return a value on the right of an equals sign."""
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + "".join(f"  {_toml(each)},\n" for each in value) + "]"
    if isinstance(value, list):
        return "[" + ", ".join(_toml(each) for each in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k} = {_toml(v)}" for k, v in value.items()) + "}"
    # JSON's numbers, words and strings are TOML's
    return json.dumps(value, ensure_ascii=False)
