"""A recorded session on disk: the folder ``NAME.paravol``.

::

    session.json    what was flown, with which versions; written first
    stream.mcap     samples, frames and edits, appended as they come
    snapshots/      high-quality pictures
    result.json     score and figures; written last, absent after a crash

The stream is an MCAP file: open, CRC-checked, append-only. One that ends in the middle
is read up to its last complete chunk, so a crash costs half a second at most; so does a
damaged byte, see `scenarios.bundle.reader`.
"""

from scenarios.bundle.info import SessionInfo, write_json
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
    "PatientRecord",
    "Record",
    "Recording",
    "SampleRecord",
    "SessionInfo",
    "SessionRecorder",
    "read_recording",
    "read_session",
    "write_json",
]
