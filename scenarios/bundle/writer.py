"""Write a session as it happens."""

import threading
from pathlib import Path
from typing import Any

import msgspec

from devices.port import Closing
from disk import UserError
from scenarios.bundle.info import SessionInfo, write_json
from scenarios.bundle.records import TOPICS, EventRecord, Record, SampleRecord

_FLUSH_EVERY = 50
"""Samples between two flushes: half a second at 100 Hz."""


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
                kind.__name__,
                "jsonschema",
                msgspec.json.encode(msgspec.json.schema(kind)),
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
