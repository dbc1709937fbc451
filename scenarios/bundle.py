"""A recorded session on disk: the folder ``NAME.paravol``.

::

    session.json    what was flown, with which versions; written first
    stream.mcap     samples and frames, appended as they come
    snapshots/      high-quality pictures
    result.json     score and figures; written last, absent after a crash

The stream is an MCAP file: open, CRC-checked, append-only. One that ends in the middle
is read up to its last complete chunk, so a crash costs half a second at most; so does a
damaged byte, see `scenarios.stream`.
"""

import json
import threading
from pathlib import Path
from typing import Any, Literal, NamedTuple

import msgspec

from devices.port import Closing
from disk import UserError, whole_file
from disk.typed_record import decode_json
from scenarios.records import (
    TOPICS,
    EventRecord,
    FrameRecord,
    Record,
    SampleRecord,
)
from scenarios.stream import Damage, read_stream

__all__ = [
    "Damage",
    "EventRecord",
    "FrameRecord",
    "Record",
    "Recording",
    "SampleRecord",
    "SessionInfo",
    "SessionRecorder",
    "read_recording",
    "read_session",
    "write_json",
]

SCHEMA_VERSION = 1

_FLUSH_EVERY = 50
"""Samples between two flushes: half a second at 100 Hz."""


class SessionInfo(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Describe a session well enough to run it again.

    scenario: the scenario file's text, so that a replay does not depend on it.
    world_from_device: the registration, 16 numbers in row order.
    surface_sha256: hash of the air distance values that were flown through.
    look: version of the picture's look; recordings from before it was counted have 1.
    structures_sha256: hash of what names the structures that were touched; "" in
        recordings from before they were named.
    automatic: recorded unasked; may be removed when room is needed.
    """

    scenario_name: str
    scenario: str
    picture_size: tuple[int, int]
    tier: str
    seed: int
    world_from_device: list[float]
    registration_rms_mm: float
    surface_sha256: str
    has_instrument: bool
    created: str
    versions: dict[str, str]
    look: int = 1
    structures_sha256: str = ""
    automatic: bool = False
    schema_version: Literal[1] = 1


def write_json(path: Path, value: object) -> None:
    """Write JSON for people, atomically."""
    text = json.dumps(msgspec.to_builtins(value), indent=2, allow_nan=False) + "\n"
    with whole_file(path) as beside:
        beside.write_text(text, "utf-8")


class SessionRecorder(Closing):
    """Write a session as it happens; a context manager.

    Whatever has been added when the program dies can be replayed, up to the last
    flush. Samples and frames may be added by two threads.
    """

    def __init__(self, folder: Path, info: SessionInfo) -> None:
        """Create `folder` and start the stream.

        Raises ValueError when the folder exists and holds something, OSError when it
        cannot be written.
        """
        from mcap.writer import CompressionType, Writer

        if folder.exists() and any(folder.iterdir()):
            raise UserError(
                f"The folder {folder} already holds a session; choose another name or "
                "remove it."
            )
        (folder / "snapshots").mkdir(parents=True, exist_ok=True)
        write_json(folder / "session.json", info)
        self.folder = folder
        self._file = open(folder / "stream.mcap", "wb")  # noqa: SIM115 (closed below)
        # typed as Any: part of the library carries no annotations
        self._writer: Any = Writer(self._file, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library="paravol")
        self._channels = {}
        for topic, kind in TOPICS.items():
            schema = self._writer.register_schema(
                kind.__name__, "jsonschema", msgspec.json.encode(_schema(kind))
            )
            self._channels[kind] = self._writer.register_channel(topic, "json", schema)
        self._unflushed = 0
        self._last_ns = 0
        self._counts = dict.fromkeys(TOPICS.values(), 0)
        self._adding = threading.Lock()
        self.samples = 0

    def add(self, record: Record) -> None:
        """Append one record."""
        data = msgspec.json.encode(record)
        with self._adding:
            if isinstance(record, SampleRecord | EventRecord):
                self._last_ns = int(record.time_s * 1e9)
            if isinstance(record, SampleRecord):
                self.samples += 1
            self._writer.add_message(
                self._channels[type(record)],
                log_time=max(self._last_ns, 0),
                data=data,
                publish_time=max(self._last_ns, 0),
                # tells a reader how many are missing, should some be damaged
                sequence=self._counts[type(record)],
            )
            self._counts[type(record)] += 1
            self._unflushed += 1
            if self._unflushed >= _FLUSH_EVERY:
                self.flush()

    def flush(self) -> None:
        """Hand everything so far to the operating system."""
        self._writer.flush()
        self._file.flush()
        self._unflushed = 0

    def close(self, result: object | None = None) -> None:
        """Finish the stream and write the result, if there is one; idempotent."""
        if not self._file.closed:
            self._writer.finish()
            self._file.close()
            if result is not None:
                write_json(self.folder / "result.json", result)


class Recording(NamedTuple):
    """Hold what a bundle holds.

    records: in order. complete: the stream was closed properly. damages: parts of the
    stream that cannot be read. places: where samples are among those in `records`, by
    their numbers in the flight, which frames name; lost ones are not there.
    """

    info: SessionInfo
    records: list[Record]
    complete: bool
    damages: tuple[Damage, ...]
    places: dict[int, int]


def read_session(folder: Path) -> tuple[SessionInfo, list[Record], bool]:
    """Read a bundle: its description, its records in order, whether it is complete.

    See `read_recording`, which tells of damage, too.
    """
    return read_recording(folder)[:3]


def read_recording(folder: Path) -> Recording:
    """Read a bundle, and past any damage of its stream.

    A stream that ends in the middle gives the records before the end. Raises
    ValueError, in one sentence, when there is no session to read at all.
    """
    try:
        raw = (folder / "session.json").read_bytes()
    except OSError as error:
        raise UserError(
            f"{folder} is not a session: session.json cannot be read "
            f"({error.strerror})."
        ) from error
    info = decode_json(raw, SessionInfo, folder / "session.json", "a session")
    stream = read_stream(folder / "stream.mcap")
    return Recording(
        info, stream.records, stream.complete, stream.damages, stream.places
    )


def _schema(kind: type[Any]) -> dict[str, Any]:
    return msgspec.json.schema(kind)
