"""A recorded session on disk: the folder ``NAME.paravol``.

::

    session.json    what was flown, with which versions; written first
    stream.mcap     samples and frames, appended as they come
    snapshots/      high-quality pictures
    result.json     score and figures; written last, absent after a crash

The stream is an MCAP file: open, CRC-checked, append-only. One that ends in the middle
is read up to its last complete chunk, so a crash costs half a second at most.
"""

import io
import json
import os
import struct
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np

from devices.closing import Closing
from disk import whole_file
from scenarios.session import Sample

SCHEMA_VERSION = 1

_FLUSH_EVERY = 50
"""Samples between two flushes: half a second at 100 Hz."""

_RECORD_LIMIT_BYTES = 1 << 24
"""No record of ours is near this; a larger one means a damaged file."""


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


class SampleRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One measured sample; see `scenarios.session.Sample`."""

    time_s: float
    device_from_tip: list[float]
    roll_deg: float
    instrument_tip_mm: list[float]
    instrument_pointing: list[float]
    buttons: int

    @classmethod
    def of(cls, sample: Sample) -> "SampleRecord":
        """Make the record of a sample. Floats keep all their bits."""
        return cls(
            sample.time_s,
            [float(v) for v in sample.device_from_tip.ravel()],
            sample.roll_deg,
            [float(v) for v in sample.instrument_tip_mm],
            [float(v) for v in sample.instrument_pointing],
            sample.buttons,
        )

    def sample(self) -> Sample:
        """Give the sample back, bit by bit."""
        if len(self.device_from_tip) != 16:
            raise ValueError(
                f"a pose has 16 numbers, the record has {len(self.device_from_tip)}"
            )
        return Sample(
            self.time_s,
            np.array(self.device_from_tip).reshape(4, 4),
            self.roll_deg,
            np.array(self.instrument_tip_mm),
            np.array(self.instrument_pointing),
            self.buttons,
        )


class FrameRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One picture as it was shown.

    sample: index of the sample it shows, counted from 0 in this stream.
    gain: the camera's gain; stored because it depends on all frames before.
    xxh3_128: hash of the picture's bytes. blake2b: what stood there in recordings of
    looks before 3, whose pictures are not compared.
    """

    number: int
    sample: int
    gain: float
    clearance_mm: float
    xxh3_128: str = ""
    blake2b: str = ""


class EventRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Something worth remembering: a snapshot request, a device error, the end."""

    time_s: float
    kind: str
    text: str


Record = SampleRecord | FrameRecord | EventRecord

_TOPICS: dict[str, type[SampleRecord] | type[FrameRecord] | type[EventRecord]] = {
    "/sample": SampleRecord,
    "/frame": FrameRecord,
    "/event": EventRecord,
}


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
            raise ValueError(
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
        for topic, kind in _TOPICS.items():
            schema = self._writer.register_schema(
                kind.__name__, "jsonschema", msgspec.json.encode(_schema(kind))
            )
            self._channels[kind] = self._writer.register_channel(topic, "json", schema)
        self._unflushed = 0
        self._last_ns = 0
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
            )
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


def read_session(folder: Path) -> tuple[SessionInfo, list[Record], bool]:
    """Read a bundle: its description, its records in order, whether it is complete.

    A stream that ends in the middle gives the records before the damage. Raises
    ValueError, in one sentence, when there is no session to read at all.
    """
    try:
        raw = (folder / "session.json").read_bytes()
    except OSError as error:
        raise ValueError(
            f"{folder} is not a session: session.json cannot be read "
            f"({error.strerror})."
        ) from error
    try:
        info = msgspec.json.decode(raw, type=SessionInfo)
    except msgspec.DecodeError as error:
        raise ValueError(f"{folder}/session.json is not valid: {error}.") from error
    records: list[Record] = []
    complete = False
    for item in _records(folder / "stream.mcap"):
        if item is None:
            complete = True
        else:
            records.append(item)
    return info, records, complete


def _records(path: Path) -> Iterator[Record | None]:
    """Yield records, then None if the stream was closed properly."""
    from mcap.exceptions import InvalidMagic, McapError
    from mcap.records import Channel, Footer, Message
    from mcap.stream_reader import StreamReader
    from mcap.writer import MCAP0_MAGIC
    from zstandard import ZstdError

    topics: dict[int, str] = {}
    try:
        file = io.FileIO(path)
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}.") from error
    with file:
        reader = StreamReader(
            _Finite(file), validate_crcs=True, record_size_limit=_RECORD_LIMIT_BYTES
        )
        try:
            for record in reader.records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                elif isinstance(record, Message):
                    kind = _TOPICS.get(topics.get(record.channel_id, ""))
                    if kind is not None:
                        yield msgspec.json.decode(record.data, type=kind)
                elif isinstance(record, Footer):
                    yield None
        except InvalidMagic as error:
            file.seek(0)
            if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise ValueError(f"{path} is not an MCAP stream.") from error
        except (McapError, ValueError, struct.error, EOFError, ZstdError):
            # The library reports a cut or damaged file in all these ways. What came
            # before is good: every chunk carries its own checksum.
            return


class _Finite(io.BufferedReader):
    """Ask for no more memory than the file has bytes, whatever a length says."""

    def read(self, size: int | None = -1, /) -> bytes:
        """Read up to `size` bytes, all that are left if it is negative."""
        left = os.fstat(self.fileno()).st_size - self.tell()
        return super().read(left if size is None or size < 0 else min(size, left))


def _schema(kind: type[Any]) -> dict[str, Any]:
    return msgspec.json.schema(kind)
