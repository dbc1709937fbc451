"""The cavity that a recorded operation left."""

from pathlib import Path

from paravol.patient import PatientScene
from paravol.recorded_flight import cut_again, samples_of, why_stepped
from paravol.session_replay import recorded_score
from paravol.session_setup import reopen_session
from scenarios.bundle import read_recording
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
    if not why_stepped(folder, recording, recorded_score(folder)):
        return cavity_of(cut_again(recording, patient))
    _, session = reopen_session(folder, info, patient)
    for record in samples_of(recording):
        session.step(record.sample())
    assert session.operation is not None
    return cavity_of(session.operation.patient)


def cavity_of(patient: OperatedPatient | None) -> Cavity | None:
    """Return what was taken of a patient; None without one."""
    if patient is None:
        return None
    return Cavity.between(patient.pristine.distance, patient.surface.distance)
