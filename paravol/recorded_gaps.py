"""What a recording's samples meant, measured all at once instead of stepped.

A session is stepped sample by sample, and operated on as it was, to know it to the bit.
To score one that was stepped when it was flown, this is not needed: its stream holds
the cuts and its result what came of them. Here each cut is made again from its recorded
solids, and the gaps of the poses between two cuts are measured by one compiled loop.
All that the stream says twice must agree, see `check_recorded`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from disk import UserError
from paravol.patient import PatientScene
from paravol.versions import versions
from scenarios import Score
from scenarios.bundle import (
    EditRecord,
    EventRecord,
    FrameRecord,
    PatientRecord,
    Recording,
)
from scenarios.clearance import Clearance, shaft_clearances
from scenarios.hazard_watch import STEP_MM
from scenarios.instruments.catalogue import instrument_named
from scenarios.metrics import Contacts
from scenarios.scoring import CONTACT_MM, counted_path_mm
from scenarios.session import SHAFT_CHECKED_MM
from scenarios.structures import TISSUE
from surgery.patient import OperatedPatient
from surgery.solids import ROW, SEED

Doubles = NDArray[np.float64]

EXACT_MM = 1e-6
"""Gaps measured at once may differ by so much from those of a step, by rounding."""


class ChangedStreamError(UserError):
    """A recording contradicts itself: it was changed, or another version made it."""


def demand_as_flown(folder: Path, recording: Recording) -> None:
    """Raise ChangedStreamError where what is judged by is not what was flown."""
    if recording.is_edited:
        raise ChangedStreamError(
            f"{folder} was changed after the flight: exercise or registration in "
            "session.json are not those that were flown; give it as it was recorded."
        )


@dataclass(frozen=True, slots=True)
class Poses:
    """Hold the samples' poses in the patient, mm.

    scope: ``(n, 4, 4)`` world_from_tip. tool_mm: ``(n, 3)`` tip of the tool, NaN where
    none was held.
    """

    time_s: Doubles
    scope: Doubles
    tool_mm: Doubles


@dataclass(frozen=True, slots=True)
class RecordedGaps:
    """Hold each sample's gaps: of the scope to tissue, and of both tools to hazards.

    operated: the patient as the cuts left it; None where nothing was cut.
    """

    contacts: Contacts
    hazards: Mapping[str, Doubles] | None
    tool_hazards: Mapping[str, Doubles] | None
    operated: OperatedPatient | None = None


def why_untrusted(
    recording: Recording, score: Score | None, *, has_frozen: bool, undone: int
) -> str:
    """Return why a recording must be stepped to be known; "" where it need not be."""
    if not recording.complete or recording.damages:
        return "the stream is damaged or has no end"
    if score is None:
        return "there is no result"
    if recording.info.operated and score.operation is None:
        return "the result does not say what the operation came to"
    if undone:
        return "cuts were taken back"
    if has_frozen:
        return "the trainer was frozen"
    made, now = recording.info.versions, versions()
    if made.get("paravol-ess") != now["paravol-ess"]:
        return "another version of the program recorded it"
    return ""


def recorded_gaps(
    recording: Recording,
    patient: PatientScene,
    poses: Poses,
    radius_mm: float,
    *,
    has_names: bool,
) -> RecordedGaps:
    """Measure the gaps of all samples, through the head as the cuts left it by then.

    radius_mm: of the scope. has_names: name what was touched, which takes longer.
    ChangedStreamError where a cut does not take what was recorded, or the patient is
    not the recorded one.
    """
    times = poses.time_s
    gap, at = np.empty(len(times)), np.empty((len(times), 3))
    names: dict[str, int] = {}
    touched = np.full(len(times), -1)
    distance, structures = patient.surface.distance, patient.structures
    cuts = _cuts_of(recording)
    operated = None
    if cuts:
        operated = _whole(patient)
        distance = operated.surface.distance
        if structures is not None:
            structures = replace(structures, distance=distance)
    begin = 0
    for cut in [*cuts, None]:
        # a sample's gap is measured before the cut that it makes
        end = len(times)
        if cut is not None:
            end = int(np.searchsorted(times, cut.time_s, side="right"))
        here = slice(begin, max(begin, end))
        gap[here], at[here] = shaft_clearances(
            distance, poses.scope[here], radius_mm, SHAFT_CHECKED_MM
        )
        for place in begin + np.flatnonzero(gap[here] < CONTACT_MM):
            name = TISSUE
            if has_names and structures is not None:
                name = structures.touched(Clearance(float(gap[place]), at[place]))
            touched[place] = names.setdefault(name, len(names))
        begin = here.stop
        if operated is not None and cut is not None:
            _make(cut, operated, cut is cuts[-1])
    return RecordedGaps(
        Contacts(times, gap, touched, tuple(names)),
        *_hazard_gaps(patient, poses, radius_mm),
        operated,
    )


def cut_again(recording: Recording, patient: PatientScene) -> OperatedPatient:
    """Return the patient as all recorded cuts left it.

    ChangedStreamError as in `recorded_gaps`.
    """
    cuts, operated = _cuts_of(recording), _whole(patient)
    for cut in cuts:
        _make(cut, operated, cut is cuts[-1])
    return operated


def _cuts_of(recording: Recording) -> list[EditRecord | PatientRecord]:
    return [r for r in recording.records if isinstance(r, EditRecord | PatientRecord)]


def _whole(patient: PatientScene) -> OperatedPatient:
    structures = patient.structures
    labels = None if structures is None else structures.labels
    return OperatedPatient(patient.surface, patient.layers, labels)


def _make(
    cut: EditRecord | PatientRecord, operated: OperatedPatient, is_last: bool
) -> None:
    """Cut again, and compare what that took; compare the patient at the end."""
    if isinstance(cut, PatientRecord):
        if is_last and operated.hash() != cut.xxh3_128:
            raise ChangedStreamError(
                f"The recorded cuts do not leave the patient that was recorded at "
                f"{cut.time_s:.2f} s: the stream was changed."
            )
        return
    solids = np.array(cut.solids).reshape(-1, ROW)
    taker = instrument_named(cut.tool).taker
    stroke = int(solids[0, SEED])
    made = operated.carve(
        solids, taker, time_s=cut.time_s, tool=cut.tool, stroke=stroke
    )
    if made is None or EditRecord.of(made) != cut:
        raise ChangedStreamError(
            f"The cut number {cut.number} at {cut.time_s:.2f} s does not take what was "
            "recorded: the stream was changed."
        )


def _hazard_gaps(
    patient: PatientScene, poses: Poses, radius_mm: float
) -> tuple[dict[str, Doubles] | None, dict[str, Doubles] | None]:
    hazards = patient.hazards
    if hazards is None:
        return None, None
    count = max(int((SHAFT_CHECKED_MM - radius_mm + STEP_MM / 2) / STEP_MM) + 1, 1)
    back = poses.scope[:, :3, 2]
    begins = poses.scope[:, :3, 3] + radius_mm * back
    held: NDArray[np.bool_] = np.all(np.isfinite(poses.tool_mm), axis=1)
    tips = poses.tool_mm[held]
    scope, tool = {}, {}
    for name in hazards.names:
        along = hazards.along_each_mm(name, begins, STEP_MM * back, count)
        scope[name] = along - radius_mm
        tool[name] = np.full(len(held), np.nan)
        tool[name][held] = hazards.along_each_mm(name, tips, np.zeros_like(tips), 1)
    return scope, tool


def check_recorded(
    recording: Recording,
    score: Score,
    gaps: RecordedGaps,
    poses: Poses,
    targets: Mapping[str, Doubles],
) -> None:
    """Raise ChangedStreamError where the stream and the result do not agree.

    Compared: duration, path length, smallest gap, contacts and nearest approaches of
    the result with those of the samples; each frame's gap with its sample's; what was
    taken and the number of injuries with the stream's cuts and events.
    """
    times, gap = gaps.contacts.time_s, gaps.contacts.gap_mm
    tips = poses.scope[:, :3, 3]
    deep = gap < CONTACT_MM
    first = bool(deep[0])
    found = {
        "duration": (score.duration_s, times[-1] - times[0]),
        "path length": (score.path_length_mm, counted_path_mm(times, tips)),
        "smallest gap": (score.min_clearance_mm, gap.min()),
        "number of contacts": (score.contacts, first + (np.diff(deep * 1) > 0).sum()),
    }
    for name, at in targets.items():
        near = np.linalg.norm(tips - at, axis=1).min()
        found[f"distance to {name}"] = score.target_distance_mm.get(name, near), near
    if score.operation is not None:
        edits = [r for r in recording.records if isinstance(r, EditRecord)]
        hurt = [
            r
            for r in recording.records
            if isinstance(r, EventRecord) and r.kind == "injury"
        ]
        taken = math.fsum(mm3 for edit in edits for mm3 in edit.taken_mm3.values())
        told = math.fsum(score.operation.removed_mm3.values())
        found["number of cuts"] = score.operation.edits, len(edits)
        found["number of injuries"] = len(score.operation.injuries), len(hurt)
        found["volume taken"] = told, taken
    for what, (told, is_now) in found.items():
        if not math.isclose(told, is_now, rel_tol=1e-9, abs_tol=EXACT_MM):
            raise ChangedStreamError(
                f"The {what} was recorded as {told:.6g} and is {is_now:.6g} by the "
                "samples: the stream or its result was changed."
            )
    for record in recording.records:
        if isinstance(record, FrameRecord):
            place = recording.places.get(record.sample)
            if place is None or place >= len(gap):
                continue
            if abs(gap[place] - record.clearance_mm) > EXACT_MM:
                raise ChangedStreamError(
                    f"The gap of frame {record.number} was recorded as "
                    f"{record.clearance_mm:.6g} mm and is {gap[place]:.6g} mm by its "
                    "sample: the stream was changed."
                )
