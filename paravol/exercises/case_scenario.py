"""An exercise for a case: a flight straight in and out, written beside it.

The scenario file is made for a person to edit; it is not written over.
"""

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from anatomy.case import Case, read_case
from anatomy.files.volumes import write_file
from anatomy.scan.approach import Approach, air_reach, approach_from
from anatomy.scan.face_points import face_points
from anatomy.scan.imported import WAY_END
from devices import ProbePath, save_probe_path
from paravol.output_folder import EXERCISE_FILES
from renderers.scene.volume import Volume
from system import UserError

SCENARIO, PATH = EXERCISE_FILES

BEFORE_MM = 12.0
"""Of the way outside the pivot."""

SHORTEST_MM = 5.0
"""A flight of less shows nothing."""

SPEED_MM_S = 10.0
TICK_S = 0.1

ASIDE_MM = 60.0
"""Behind the scope's tip the suction tube waits, out of sight."""

NOSTRILS = ("nostril, right", "nostril, left")


def scenario_of_case(folder: Path, case: Case | None = None) -> Path:
    """Return the scenario file of a case, writing it if there is none.

    case: what is in the folder, where the caller has it already.
    Raises UserError for a folder that is no case or has nowhere to enter.
    """
    file = folder / SCENARIO
    if not file.exists() or not (folder / PATH).exists():
        case = case or read_case(folder)
        approach = _approach(folder, case)
        save_probe_path(
            straight_path(approach, case.volumes.get("distance")), folder / PATH
        )
        write_file(file, scenario_text(folder, case, approach).encode())
    return file


def straight_path(approach: Approach, distance: Volume | None = None) -> ProbePath:
    """Make the motion along the free way and back, calm at its ends.

    distance: signed mm to the air surface; where it shows tissue before or behind the
    pivot, the motion begins or turns back before it. Raises UserError where less than
    `SHORTEST_MM` is left.
    """
    before, inwards = BEFORE_MM, max(approach.free_mm - 2.0, 5.0)
    if distance is not None:
        way = approach.axis / np.linalg.norm(approach.axis)
        before = air_reach(distance, approach.pivot_mm, -way, before)
        inwards = air_reach(distance, approach.pivot_mm, way, inwards)
    length = before + inwards
    if length < SHORTEST_MM:
        raise UserError(
            f"the way in from {np.round(approach.pivot_mm, 1).tolist()} mm meets "
            f"tissue after {inwards:.1f} mm; name an entrance with more air before it "
            "with --pivot x y z"
        )
    half = max(np.pi / 2 * length / SPEED_MM_S, 2.0)
    t_s = np.arange(round(2 * half / TICK_S) + 1) * TICK_S
    depth = length / 2 * (1 - np.cos(np.pi * t_s / half)) - before
    tip = approach.pivot_mm + depth[:, None] * approach.axis
    axis = np.repeat(approach.axis[None] / np.linalg.norm(approach.axis), len(t_s), 0)
    return ProbePath(
        name="straight in",
        t_s=np.round(t_s, 6),
        tip_mm=tip,
        axis=axis,
        roll_deg=np.zeros(len(t_s)),
        instrument_tip_mm=tip - ASIDE_MM * axis,
        instrument_axis=axis,
        buttons=np.zeros(len(t_s), np.int64),
        source="the longest free way from the entrance and back",
    )


def scenario_text(folder: Path, case: Case, approach: Approach) -> str:
    """Write the scenario file of a case."""
    touched = {
        name: mark.position_mm
        for name, mark in case.landmarks.items()
        if name.startswith("face ")
    }
    if len(touched) < 4:
        touched = _face(case, approach)
    note = "Divots to be touched on the mock head, LPS mm: move them to where its are."
    if len(touched) < 4:
        touched = _box_front(case)
        note = "The scan shows too little skin: these are corners of its box, LPS mm."
    target = f"targets = [{json.dumps(WAY_END)}]" if WAY_END in case.landmarks else ""
    lines = [
        f"# A flight through the case in this folder. {note}",
        'name = "case"',
        f"title = {json.dumps('Case ' + folder.resolve().name)}",
        f"path = {json.dumps(PATH)}",
        target,
        "fiducials = [",
        *(
            f"  {{name = {json.dumps(name)}, position_mm = "
            f"[{', '.join(f'{v:.3f}' for v in place)}]}},"
            for name, place in touched.items()
        ),
        "]",
        "",
        "[head]",
        'case = "."',
    ]
    return "\n".join(lines) + "\n"


def _approach(folder: Path, case: Case) -> Approach:
    way = case.record.approach
    if way is not None:
        return Approach(np.array(way.pivot_mm), np.array(way.axis), way.free_mm)
    if case.record.sources:
        raise UserError(
            f"No entrance was found in the case {folder}; look for one with paravol "
            f"slices {folder}, then import the scan again with --pivot x y z."
        )
    nostrils = [case.landmarks[n].position_mm for n in NOSTRILS if n in case.landmarks]
    if not nostrils or "distance" not in case.volumes:
        raise UserError(
            f"The case {folder} has no nostril among its landmarks and no distance "
            "volume; make it again with paravol import or paravol phantom."
        )
    ways = [approach_from(case.volumes["distance"], place) for place in nostrils]
    return max(ways, key=lambda way: way.free_mm)


def _face(case: Case, approach: Approach) -> dict[str, NDArray[np.float64]]:
    """Look for skin in the case's own, smaller, box."""
    if "distance" not in case.volumes:
        return {}
    distance = case.volumes["distance"]
    open_air = distance.with_values(distance.values, -1.0)
    return face_points(open_air, approach.pivot_mm)


def _box_front(case: Case) -> dict[str, NDArray[np.float64]]:
    """Return four corners of the case's front, no two distances alike."""
    low = case.ct.origin_mm
    high = low + (np.array(case.ct.shape[::-1]) - 1) * case.ct.spacing_mm
    wide, _, tall = high - low
    corners = ((0.05, 0.1), (0.9, 0.0), (0.1, 0.85), (0.8, 1.0))
    return {
        f"corner {n}": np.array(
            [low[0] + u * wide, low[1] + 6.0 * n, low[2] + v * tall]
        )
        for n, (u, v) in enumerate(corners, start=1)
    }
