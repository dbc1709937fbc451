"""Write a session as it happens."""

import os
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from devices.port import Closing
from scenarios.bundle.info import SessionInfo, write_json
from scenarios.bundle.records import (
    SEAL,
    TOPICS,
    EventRecord,
    Record,
    SampleRecord,
    StreamHash,
)
from system import UserError

_FLUSH_EVERY = 50
"""Records between two flushes, so that no chunk holds much."""

_FLUSH_AFTER_S = 0.2
"""Host seconds that a record waits at most, however few come after it. A process that
is killed loses what waits and what is being written: less than half a second."""


class SessionRecorder(Closing):
    """Write a session as it happens; a context manager.

    What was added half a second before the program dies, by SIGKILL too, can be
    replayed: a thread hands it to the operating system, whatever else comes. Nothing
    waits for the disk, so a power failure also costs what the system still holds in
    memory (on Linux 30 s as a rule); the end of a session is waited for. Samples and
    frames may be added by two threads.
    """

    def __init__(
        self,
        folder: Path,
        info: SessionInfo,
        on_refusal: Callable[[OSError], None] | None = None,
    ) -> None:
        """Create `folder` and start the stream.

        on_refusal: is told, once, that the disk refuses to take more; what is added
        then is counted and lost, and nothing is raised. None raises. Raises UserError
        when the folder exists and holds something, OSError when it cannot be written.
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
        self._hash = StreamHash()
        self._last_ns = 0
        self._counts = dict.fromkeys(TOPICS.values(), 0)
        self._adding = threading.Lock()
        self.samples = 0
        self._refusal: OSError | None = None
        # before the first sample there is a stream to be opened already
        try:
            self._append(EventRecord(0.0, SEAL, info.seal()))
            self.flush()
        except OSError:
            with suppress(OSError):
                self._file.close()
            raise
        self._ended = threading.Event()
        self._on_refusal, self._is_full = on_refusal, False
        self._flusher = threading.Thread(
            target=self._flush_in_time, name="recording", daemon=True
        )
        self._flusher.start()

    def add(self, record: Record) -> None:
        """Append one record; OSError where the disk refuses this one or one before."""
        with self._adding:
            if isinstance(record, SampleRecord):
                self.samples += 1
            if self._is_full:
                return
            try:
                self._append(record)
            except OSError as error:
                self._refuse(error)

    def _refuse(self, error: OSError) -> None:
        """Tell that nothing more is written; raise it where nobody is to be told."""
        if self._on_refusal is None:
            raise error
        if not self._is_full:
            self._is_full = True
            self._on_refusal(error)

    def _append(self, record: Record) -> None:
        data = msgspec.json.encode(record)
        self._hash.add(data)
        if self._refusal is not None:
            raise self._refusal
        if isinstance(record, SampleRecord | EventRecord):
            self._last_ns = int(record.time_s * 1e9)
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

    def _flush_in_time(self) -> None:
        """Flush what waits, until the end."""
        while not self._ended.wait(_FLUSH_AFTER_S):
            with self._adding:
                if self._unflushed and not self._file.closed:
                    try:
                        self.flush()
                    except OSError as error:
                        self._refusal = error
                        return

    def close(self, result: Mapping[str, object] | None = None) -> None:
        """Finish the stream and write the result, if there is one; idempotent.

        The result has, as "stream", the hash of all records that it was made of.
        """
        self._ended.set()
        self._flusher.join()
        if self._file.closed:
            return
        try:
            if not self._is_full:
                self._writer.finish()
                self._file.flush()
                os.fsync(self._file.fileno())
                if result is not None:
                    sealed = {**result, "stream": self._hash.hexdigest()}
                    write_json(self.folder / "result.json", sealed)
        except OSError as error:
            self._refuse(error)
        finally:
            # what could not be written yet is tried once more
            with suppress(OSError):
                self._file.close()
