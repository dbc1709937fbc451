"""The cavity that a recorded operation left."""

from pathlib import Path

from paravol.patient import PatientScene
from paravol.recorded_gaps import cut_again, why_untrusted
from paravol.session_replay import recorded_score
from paravol.session_setup import reopen_session
from scenarios.bundle import EditRecord, SampleRecord, read_recording
from scenarios.metrics.cavity import Cavity
from surgery.patient import OperatedPatient


def recorded_cavity(folder: Path, patient: PatientScene) -> Cavity | None:
    """Return what a session took of this head; None where nobody operated.

    patient: as before anybody operated. UserError for a session of another head. Its
    cuts are made again from their solids where they can be checked, else it is stepped.
    """
    recording = read_recording(folder)
    info = recording.info
    if patient.surface_sha256 != info.surface_sha256:
        reopen_session(folder, info, patient)  # says what is wrong
    if not info.operated:
        return None
    samples = [r.sample() for r in recording.records if isinstance(r, SampleRecord)]
    score = recorded_score(folder)
    why = why_untrusted(
        recording,
        score,
        has_frozen=any(sample.is_frozen for sample in samples),
        undone=max((sample.instrument.undone for sample in samples), default=0),
    )
    cuts = sum(isinstance(record, EditRecord) for record in recording.records)
    figures = None if score is None else score.operation
    if not why and figures is not None and figures.edits == cuts:
        return cavity_of(cut_again(recording, patient))
    _, session = reopen_session(folder, info, patient)
    for sample in samples:
        session.step(sample)
    assert session.operation is not None
    return cavity_of(session.operation.patient)


def cavity_of(patient: OperatedPatient | None) -> Cavity | None:
    """Return what was taken of a patient; None without one."""
    if patient is None:
        return None
    return Cavity.between(patient.pristine.distance, patient.surface.distance)
