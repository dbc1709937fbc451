"""Flights whose program was killed: found, finished afterwards, or thrown away.

The stream of such a flight is whole up to half a second before its end. It has no
result, because that is written last.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

import msgspec

from paravol.patient import PatientScene, Progress, load_patient, no_progress
from paravol.sessions.session_setup import flown_scenario, reopen_session
from paravol.sessions.session_store import (
    SessionStore,
    hold_session,
    is_held,
    remove_session,
)
from scenarios import Score
from scenarios.bundle import read_recording, write_json
from system import UserError

RESULT = "result.json"


@dataclass(frozen=True, slots=True)
class UnfinishedSession:
    """What was flown, and until when it was recorded.

    folder: of its recording. title: of its exercise. created: when it began, ISO 8601.
    length_s: seconds of flight that are there.
    """

    folder: Path
    title: str
    created: str
    length_s: float


class _Named(msgspec.Struct):
    """The part of a scenario that says what it is called."""

    title: str


def unfinished_sessions(store: SessionStore) -> list[UnfinishedSession]:
    """Return the automatic recordings without a result, the newest first.

    Left out are those that somebody records now, those in which nothing was flown yet
    and those that cannot be read.
    """
    found = []
    for folder in store.sessions():
        if not (folder / RESULT).exists() and not is_held(folder):
            try:
                session = unfinished_session(folder)
            except UserError:
                continue
            if session.length_s > 0.0:
                found.append(session)
    return sorted(found, key=lambda session: session.created, reverse=True)


def unfinished_session(folder: Path) -> UnfinishedSession:
    """Describe one such recording; UserError where it has a result or is none."""
    if (folder / RESULT).exists():
        raise UserError(f"{folder} was finished: it has a {RESULT}.")
    recording = read_recording(folder)
    info = recording.info
    try:
        title = msgspec.json.decode(info.scenario, type=_Named).title
    except (ValueError, RecursionError):
        title = info.scenario_name
    last_s = max((record.time_s for record in recording.samples), default=0.0)
    return UnfinishedSession(folder, title, info.created, last_s)


def recover(
    session: UnfinishedSession,
    progress: Progress = no_progress,
    patient: PatientScene | None = None,
) -> Score:
    """Score what was flown and write the result, as the end of the flight would have.

    patient: the one that was flown through, where it is loaded already. UserError where
    another program has the recording in hand, it cannot be read, or its head is not to
    be had; then nothing is changed.
    """
    folder = session.folder
    if is_held(folder):
        raise UserError(f"{folder} is being recorded, or finished by another program.")
    with hold_session(folder):
        recording = read_recording(folder)
        if patient is None:
            scenario = flown_scenario(folder, recording.info, None)
            patient = load_patient(scenario, progress)
        _, stepped = reopen_session(folder, recording.info, patient)
        samples = recording.samples
        if not samples:
            raise UserError(f"{folder} holds no flight: there is nothing to score.")
        for number, record in enumerate(samples, 1):
            stepped.step(record.sample())
            progress("Scoring what was flown", number / len(samples))
        score = stepped.score()
        write_json(folder / RESULT, {"score": asdict(score), "recovered": True})
    return score


def discard(session: UnfinishedSession) -> None:
    """Remove the recording for good; UserError where that cannot be."""
    if not remove_session(session.folder):
        raise UserError(
            f"{session.folder} cannot be removed: another program has it in hand, or "
            "the disk refuses."
        )
