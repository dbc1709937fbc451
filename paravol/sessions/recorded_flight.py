"""What a recording says of a flight, where it need not be stepped again.

The stream holds what each sample measured and what each cut took; the result holds what
came of them. What is said twice must agree.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from paravol.patient import PatientScene
from paravol.sessions.session_replay import recorded_hash
from paravol.versions import versions
from scenarios import Score
from scenarios.bundle import (
    EditRecord,
    EventRecord,
    PatientRecord,
    Recording,
    SampleRecord,
)
from scenarios.instruments.catalogue import instrument_named
from scenarios.scoring import UNKNOWN_GAP_MM
from surgery.patient import OperatedPatient
from surgery.solids import ROW
from system import UserError


class ChangedStreamError(UserError):
    """A recording contradicts itself: it was changed, or another version made it."""


def require_as_flown(folder: Path, recording: Recording) -> None:
    """Raise ChangedStreamError where what is judged by is not what was flown."""
    if recording.is_edited:
        raise ChangedStreamError(
            f"{folder} was changed after the flight: exercise or registration in "
            "session.json are not those that were flown; give it as it was recorded."
        )


def why_stepped(folder: Path, recording: Recording, score: Score | None) -> str:
    """Return why a recording must be stepped to be known; "" where it need not be."""
    if not recording.complete or recording.damages:
        return "the stream is damaged or has no end"
    if score is None:
        return "there is no result"
    if recording.info.operated and score.operation is None:
        return "the result does not say what the operation came to"
    if any(sample.reading is None for sample in recording.samples):
        return "it is of a version that did not record what was measured"
    if not recorded_hash(folder):
        return "its result does not know its stream"
    made, now = recording.info.versions, versions()
    if made.get("paravol-ess") != now["paravol-ess"]:
        return "another version of the program recorded it"
    return ""


def undone_s(samples: Sequence[SampleRecord]) -> list[float]:
    """Return when strokes were taken back, s, once for each."""
    found: list[float] = []
    for sample in samples:
        found += [sample.time_s] * (sample.instrument.undone - len(found))
    return found


def kept_edits(
    edits: Sequence[EditRecord], undone: Sequence[float]
) -> list[EditRecord]:
    """Return the cuts that were not taken back; a sample takes back before it cuts."""
    kept: list[EditRecord] = []
    left = list(undone)
    for edit in [*edits, None]:
        while left and (edit is None or left[0] <= edit.time_s):
            del left[0]
            stroke = kept[-1].stroke if kept else 0
            while kept and kept[-1].stroke == stroke:
                kept.pop()
        if edit is not None:
            kept.append(edit)
    return kept


def edits_of(recording: Recording) -> list[EditRecord]:
    """Return the recorded cuts that were not taken back."""
    edits = [r for r in recording.records if isinstance(r, EditRecord)]
    return kept_edits(edits, undone_s(recording.samples))


def cut_again(recording: Recording, patient: PatientScene) -> OperatedPatient:
    """Return the patient as the recorded cuts left it.

    ChangedStreamError where a cut does not take what was recorded, or the patient is
    not the recorded one.
    """
    structures = patient.structures
    labels = None if structures is None else structures.labels
    operated = OperatedPatient(patient.surface, patient.layers, labels)
    for cut in edits_of(recording):
        _make(cut, operated)
    hashes = [r for r in recording.records if isinstance(r, PatientRecord)]
    changes = [r.time_s for r in recording.records if isinstance(r, EditRecord)]
    changes += undone_s(recording.samples)
    is_last = bool(hashes) and hashes[-1].time_s >= max(changes, default=0.0)
    if is_last and operated.hash() != hashes[-1].xxh3_128:
        raise ChangedStreamError(
            f"The recorded cuts do not leave the patient that was recorded at "
            f"{hashes[-1].time_s:.2f} s: the stream was changed."
        )
    return operated


def _make(cut: EditRecord, operated: OperatedPatient) -> None:
    """Cut again, and compare what that took."""
    made = operated.carve(
        np.array(cut.solids).reshape(-1, ROW),
        instrument_named(cut.tool).taker,
        time_s=cut.time_s,
        tool=cut.tool,
        stroke=cut.stroke,
    )
    if made is None or (made.counts, made.taken_mm3) != (cut.counts, cut.taken_mm3):
        raise ChangedStreamError(
            f"The cut number {cut.number} at {cut.time_s:.2f} s does not take what was "
            "recorded: the stream was changed."
        )


def check_recorded(folder: Path, recording: Recording, score: Score) -> None:
    """Raise ChangedStreamError where the stream and the result do not agree.

    The result knows the hash of the stream. Its smallest gap, what was taken and the
    number of injuries are compared, too.
    """
    told = recorded_hash(folder)
    if told and told != recording.hash:
        raise ChangedStreamError(
            f"The stream of {folder} is not the one that its result was made of: it "
            "was changed."
        )
    gaps = [
        s.reading.gap_mm for s in recording.samples if s.reading and not s.is_frozen
    ]
    gap_mm = min(gaps, default=UNKNOWN_GAP_MM)
    found = {"smallest gap": (score.min_clearance_mm, gap_mm)}
    if score.operation is not None:
        hurt = sum(
            isinstance(r, EventRecord) and r.kind == "injury" for r in recording.records
        )
        taken = math.fsum(
            mm3 for edit in edits_of(recording) for mm3 in edit.taken_mm3.values()
        )
        in_all = math.fsum(score.operation.removed_mm3.values())
        found["number of injuries"] = len(score.operation.injuries), hurt
        found["volume taken"] = in_all, taken
    for what, (was, is_now) in found.items():
        if not math.isclose(was, is_now, rel_tol=1e-9, abs_tol=1e-6):
            raise ChangedStreamError(
                f"The {what} was recorded as {was:.6g} and is {is_now:.6g} by the "
                "stream: the stream or its result was changed."
            )
