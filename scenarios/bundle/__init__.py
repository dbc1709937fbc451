"""A recorded session on disk: the folder ``NAME.paravol``.

::

    session.json    what was flown, with which versions; written first
    stream.mcap     samples, frames and edits, appended as they come
    snapshots/      high-quality pictures
    result.json     score and figures; written last, absent after a crash
    notes.json      what a teacher said about it, if anything

The stream is an MCAP file: open, CRC-checked, append-only. One that ends in the middle
is read up to its last complete chunk, so a crash costs half a second at most; so does a
damaged byte, see `scenarios.bundle.reader`.
"""

from scenarios.bundle.info import SessionInfo, write_json
from scenarios.bundle.notes import Note, add_note, read_notes, remove_note
from scenarios.bundle.reader import Damage, Recording, read_recording, read_session
from scenarios.bundle.records import (
    EditRecord,
    EventRecord,
    FrameRecord,
    PatientRecord,
    Record,
    SampleRecord,
)
from scenarios.bundle.writer import SessionRecorder

__all__ = [
    "Damage",
    "EditRecord",
    "EventRecord",
    "FrameRecord",
    "Note",
    "PatientRecord",
    "Record",
    "Recording",
    "SampleRecord",
    "SessionInfo",
    "SessionRecorder",
    "add_note",
    "read_notes",
    "read_recording",
    "read_session",
    "remove_note",
    "write_json",
]
