"""Read a recorded session past any damage of its stream.

MCAP keeps messages in chunks, each with its own checksum and followed by an index that
counts its messages. A byte that went wrong costs the chunk it is in, half a second of
flight; every chunk after it is found by the head that all chunks have.
"""

import gc
import io
import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import msgspec

from scenarios.bundle.info import SessionInfo
from scenarios.bundle.records import (
    SEAL,
    TOPICS,
    EventRecord,
    Record,
    SampleRecord,
    StreamHash,
)
from system import ForeignFileError, UserError, foreign_file
from system.typed_record import decode_json

_RECORD_LIMIT_BYTES = 1 << 24
"""No record of ours is near this; a larger one means a damaged file."""

_HEAD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQI")
_ZSTD = struct.pack("<I", 4) + b"zstd"
_BEFORE_ZSTD = _HEAD.size + _CHUNK_HEAD.size
_CHANNEL, _MESSAGE = 0x04, 0x05
_CHUNK, _MESSAGE_INDEX, _DATA_END = 0x06, 0x07, 0x0F
_MESSAGE_HEAD = struct.Struct("<HI16x")
"""Channel and sequence; two times follow, of which a record of ours has its own."""
_FIRST = (0x01, 0x03, _CHANNEL, _MESSAGE_INDEX)
"""What else may stand between chunks: header, schema, channel, index."""

# Numbers that a writer gives to channels in the order in which they are made.
_CHANNELS = dict(enumerate(TOPICS, 1))

_DECODERS = {topic: msgspec.json.Decoder(kind) for topic, kind in TOPICS.items()}


@dataclass(frozen=True, slots=True)
class Damage:
    """Which part of a stream cannot be read.

    first_byte, end_byte: in the file, the latter excluded. from_s, to_s: seconds of
    flight that are lost, between the samples before and after; nothing is lost where
    they are equal. samples: how many are missing; None where that is not known.
    """

    first_byte: int
    end_byte: int
    from_s: float
    to_s: float
    samples: int | None


@dataclass(slots=True)
class Stream:
    """What a stream gave; see `Recording`."""

    records: list[Record] = field(default_factory=list)
    complete: bool = False
    damages: tuple[Damage, ...] = ()
    places: dict[int, int] = field(default_factory=dict)
    seal: str = ""
    hash: StreamHash = field(default_factory=StreamHash)


class _Message(NamedTuple):
    record: Record
    sequence: int
    data: bytes


class _Gap(NamedTuple):
    """What stands between two good chunks and should not be there.

    samples: lost ones, as the lost chunks' indices count them; None without indices.
    """

    first_byte: int
    end_byte: int
    samples: int | None


class Recording(NamedTuple):
    """What a bundle holds.

    records: in order. complete: the stream was closed properly. damages: parts of the
    stream that cannot be read. places: where samples are among those in `records`, by
    their numbers in the flight, which frames name; lost ones are not there. is_edited:
    the exercise or the registration is not the one that was flown; older recordings
    cannot tell. hash: of the records, as `SessionRecorder.close` takes it.
    """

    info: SessionInfo
    records: list[Record]
    complete: bool
    damages: tuple[Damage, ...]
    places: dict[int, int]
    is_edited: bool = False
    hash: str = ""

    @property
    def samples(self) -> list[SampleRecord]:
        """Return the records of samples, in order."""
        return [r for r in self.records if isinstance(r, SampleRecord)]


def read_session(folder: Path) -> tuple[SessionInfo, list[Record], bool]:
    """Read a bundle: its description, its records in order, whether it is complete.

    See `read_recording`, which also returns the damages.
    """
    return read_recording(folder)[:3]


def read_recording(folder: Path) -> Recording:
    """Read a bundle, and past any damage of its stream.

    A stream that ends in the middle gives the records before the end. Raises
    UserError, in one sentence, when there is no session to read at all.
    """
    try:
        raw = (folder / "session.json").read_bytes()
    except OSError as error:
        raise UserError(
            f"{folder} is not a session: session.json cannot be read "
            f"({error.strerror})."
        ) from error
    info = decode_json(raw, SessionInfo, folder / "session.json", "a session")
    if len(info.world_from_device) != 16:
        raise UserError(
            f"{folder / 'session.json'}: world_from_device has 16 numbers, got "
            f"{len(info.world_from_device)}; the file was changed."
        )
    stream = read_stream(folder / "stream.mcap")
    is_edited = bool(stream.seal) and stream.seal != info.seal()
    found = stream.records, stream.complete, stream.damages, stream.places
    return Recording(info, *found, is_edited, stream.hash.hexdigest())


def read_stream(path: Path) -> Stream:
    """Read the records; UserError, in one sentence, when it is no such stream."""
    from mcap.writer import MCAP0_MAGIC

    try:
        content = path.read_bytes()
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}.") from error
    if len(content) < len(MCAP0_MAGIC) and MCAP0_MAGIC.startswith(content):
        return Stream()  # it died before the first sample
    if content[: len(MCAP0_MAGIC)] != MCAP0_MAGIC:
        raise UserError(f"{path} is not an MCAP stream.")
    stream = Stream()
    with _uncollected():
        chunks = list(_good_chunks(content, path, stream.hash))
    if not chunks:
        return _rewritten(content)
    at = len(MCAP0_MAGIC)
    parts: list[list[_Message] | _Gap] = []
    for start, end, messages in chunks:
        gaps, _ = _between(content, at, start)
        parts += [*gaps, messages]
        at = end
    gaps, has_end = _between(content, at, len(content), is_tail=True)
    stream.complete = has_end and content.endswith(MCAP0_MAGIC)
    _join(stream, [*parts, *gaps])
    return stream


def _rewritten(content: bytes) -> Stream:
    """Read what another program has written anew, with the library's reader.

    Such a stream may be packed otherwise, or have no chunks. What comes before a damage
    is given.
    """
    from mcap.records import Channel, Message
    from mcap.stream_reader import StreamReader

    reader = StreamReader(
        io.BytesIO(content), validate_crcs=True, record_size_limit=_RECORD_LIMIT_BYTES
    )
    messages: list[_Message] = []
    topics: dict[int, str] = {}
    stream = Stream()
    with _uncollected(), suppress(ForeignFileError):
        # whatever the libraries raise is where the stream ends
        with foreign_file("the stream", "a stream"):
            for record in reader.records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                elif isinstance(record, Message):
                    decoder = _DECODERS.get(topics.get(record.channel_id, ""))
                    if decoder is not None:
                        value = decoder.decode(record.data)
                        messages.append(_Message(value, record.sequence, record.data))
                        stream.hash.add(record.data)
        stream.complete = True
    gap = [] if stream.complete or not messages else [_Gap(0, len(content), None)]
    _join(stream, [messages, *gap])
    return stream


@contextmanager
def _uncollected() -> Iterator[None]:
    """Let the collector of cycles wait: among records there are none to be found.

    It looks at all of them again each time that they have grown by a quarter, which
    takes as long as reading them.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _good_chunks(
    content: bytes, path: Path, hash_: StreamHash
) -> Iterator[tuple[int, int, list[_Message]]]:
    """Find the chunks whose checksum is right: start, end and messages of each."""
    topics = dict(_CHANNELS)
    found = content.find(_ZSTD)
    while found >= 0:
        start, body = found - _BEFORE_ZSTD, found + len(_ZSTD) + 8
        after = found + 1
        if start >= 0 and body <= len(content):
            end = body + int.from_bytes(content[body - 8 : body], "little")
            if end <= len(content):
                try:
                    with foreign_file(path, "a chunk"):
                        messages = _messages(content, start, body, end, topics)
                    for message in messages:
                        hash_.add(message.data)
                    yield start, end, messages
                    after = end
                except ForeignFileError:
                    pass
        found = content.find(_ZSTD, after)


def _messages(
    content: bytes, start: int, body: int, end: int, topics: dict[int, str]
) -> list[_Message]:
    """Unpack a chunk; whatever the libraries raise where it is none, or damaged.

    Records are taken apart here, by the layout of the MCAP specification: the
    library's reader takes five times as long.
    """
    from mcap.records import Chunk
    from mcap.stream_reader import get_chunk_data_stream

    first, last, size, checksum = _CHUNK_HEAD.unpack_from(content, start + _HEAD.size)
    if size > _RECORD_LIMIT_BYTES or not checksum:
        raise UserError(f"it unpacks to {size} bytes")
    chunk = Chunk(
        compression="zstd",
        data=content[body:end],
        message_start_time=first,
        message_end_time=last,
        uncompressed_crc=checksum,
        uncompressed_size=size,
    )
    unpacked, size = get_chunk_data_stream(chunk, validate_crc=True)
    data = unpacked.read(size)
    messages = []
    decoders = {
        channel: _DECODERS[topic]
        for channel, topic in topics.items()
        if topic in _DECODERS
    }
    at = 0
    while at < len(data):
        kind, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        after = at + length
        if after > len(data):
            raise UserError("a record of it has no end")
        if kind == _MESSAGE:
            channel, sequence = _MESSAGE_HEAD.unpack_from(data, at)
            decoder = decoders.get(channel)
            if decoder is not None:
                message = data[at + _MESSAGE_HEAD.size : after]
                messages.append(_Message(decoder.decode(message), sequence, message))
        elif kind == _CHANNEL:
            channel, _, topic = _channel(data[at:after])
            topics[channel] = topic
            if topic in _DECODERS:
                decoders[channel] = _DECODERS[topic]
        at = after
    return messages


def _channel(record: bytes) -> tuple[int, int, str]:
    """Return a channel's number, its schema's and its topic."""
    channel, schema, length = struct.unpack_from("<HHI", record)
    return channel, schema, record[8 : 8 + length].decode()


def _between(
    content: bytes, at: int, end: int, *, is_tail: bool = False
) -> tuple[list[_Gap], bool]:
    """Find what is damaged between two chunks, or after the last one.

    Tells also whether the end of the data was found, for a tail.
    """
    gaps: list[_Gap] = []
    lost_from: int | None = None
    lost: int | None = None
    while at + _HEAD.size <= end:
        kind, length = _HEAD.unpack_from(content, at)
        after = at + _HEAD.size + length
        if is_tail and kind == _DATA_END and length == 4:
            return _closed(gaps, lost_from, at, lost), True
        if after > end:
            break
        if kind == _CHUNK:
            gaps = _closed(gaps, lost_from, at, lost)
            lost_from, lost = at, None
        elif kind == _MESSAGE_INDEX and lost_from is not None:
            channel, size = struct.unpack_from("<HI", content, at + _HEAD.size)
            if _CHANNELS.get(channel) == "/sample":
                lost = size // 16
        elif kind not in _FIRST:
            break
        at = after
    if at < end:
        # what is no record; in a tail, a record that was never finished
        rest = content.rfind(_HEAD.pack(_DATA_END, 4), at) if is_tail else -1
        if rest >= 0 or not is_tail:
            whole = rest if is_tail else end
            first = at if lost_from is None else lost_from
            return _closed(gaps, first, whole, lost), is_tail
    return _closed(gaps, lost_from, at, lost), False


def _closed(
    gaps: list[_Gap], first: int | None, end: int, lost: int | None
) -> list[_Gap]:
    return gaps if first is None else [*gaps, _Gap(first, end, lost)]


def _join(stream: Stream, parts: list[list[_Message] | _Gap]) -> None:
    """Put records in order, and number the samples as they were flown."""
    number = count = 0
    known = True
    time_s = 0.0
    open_gaps: list[tuple[_Gap, float]] = []
    damages: list[Damage] = []

    def close(to_s: float) -> None:
        for gap, from_s in open_gaps:
            damages.append(Damage(*gap[:2], from_s, to_s, gap.samples))
        open_gaps.clear()

    for part in parts:
        if isinstance(part, _Gap):
            open_gaps.append((part, time_s))
            known = known and part.samples is not None
            number += part.samples or 0
            continue
        for record, sequence, _ in part:
            if isinstance(record, SampleRecord):
                if sequence:
                    number, known = sequence, True
                close(record.time_s)
                time_s = record.time_s
                if known:
                    stream.places[number] = count
                number += 1
                count += 1
            elif isinstance(record, EventRecord):
                if record.kind == SEAL:
                    stream.seal = record.text
                    continue
                time_s = max(time_s, record.time_s)
            stream.records.append(record)
    close(time_s)
    stream.damages = tuple(damages)
