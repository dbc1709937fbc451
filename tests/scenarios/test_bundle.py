import json
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from scenarios import Sample
from scenarios.bundle import (
    EventRecord,
    FrameRecord,
    Record,
    SampleRecord,
    SessionInfo,
    SessionRecorder,
    read_recording,
    read_session,
    writer,
)
from scenarios.bundle.info import write_json
from scenarios.bundle.records import StreamHash
from system import UserError
from tests.scenarios.session_info import INFO
from tests.slow_cases import slow


def sample(index: int) -> Sample:
    random = np.random.default_rng(index)
    return Sample(
        index * 0.01,
        random.normal(size=(4, 4)),
        float(random.normal()),
        random.normal(size=3),
        random.normal(size=3),
        index % 4,
        scope_deg=(None, 0.0, 30.0, 70.0)[index % 4],
        camera_roll_deg=float(index % 3),
    )


def record_all(folder: Path, count: int) -> list[Record]:
    written: list[Record] = []
    with SessionRecorder(folder, INFO) as recorder:
        for i in range(count):
            for record in (
                SampleRecord.of(sample(i)),
                FrameRecord(i, i, 1.0 / (i + 3), 0.25, "a" * 32),
            ):
                recorder.add(record)
                written.append(record)
        recorder.add(EventRecord(count * 0.01, "end", "done"))
        written.append(EventRecord(count * 0.01, "end", "done"))
    return written


def test_round_trip_keeps_every_bit(tmp_path: Path) -> None:
    written = record_all(tmp_path / "a.paravol", 130)
    info, read, complete = read_session(tmp_path / "a.paravol")
    assert info == INFO
    assert read == written
    assert complete
    first = read[0]
    assert isinstance(first, SampleRecord)
    assert np.array_equal(first.sample().device_from_tip, sample(0).device_from_tip)
    samples = [r.sample() for r in read if isinstance(r, SampleRecord)]
    assert [s.camera_roll_deg for s in samples[:4]] == [0.0, 1.0, 2.0, 0.0]


def edited(folder: Path, **changes: object) -> bool:
    info = msgspec.structs.replace(INFO, **changes)
    write_json(folder / "session.json", info)
    return read_recording(folder).is_edited


def test_who_edits_exercise_or_registration_is_found_out(tmp_path: Path) -> None:
    """And nobody else is: a program may be newer, and a case lie elsewhere."""
    record_all(tmp_path, 3)
    head = {"seed": 1, "case": "/a"}
    assert not edited(tmp_path)
    assert not edited(tmp_path, automatic=True, created="now", versions={})
    moved = [number + 1e-9 for number in INFO.world_from_device]
    assert edited(tmp_path, world_from_device=moved)
    assert edited(tmp_path, scenario='{"tasks": []}')
    assert edited(tmp_path, scenario="{")
    other = tmp_path / "other"
    told = msgspec.structs.replace(INFO, scenario=json.dumps({"a": 1, "head": head}))
    SessionRecorder(other, told).close()
    there = json.dumps({"head": {"case": "/b", "seed": 1}, "a": 1}, indent=2)
    assert not edited(other, scenario=there, world_from_device=told.world_from_device)
    assert edited(other, scenario=there.replace('"seed": 1', '"seed": 2'))


def test_frames_of_older_looks_are_still_read() -> None:
    """They had another hash, under its own name."""
    old = {"number": 3, "sample": 5, "gain": 0.5, "clearance_mm": 1.25}
    frame = msgspec.convert({**old, "blake2b": "b" * 32}, FrameRecord)
    assert frame == FrameRecord(3, 5, 0.5, 1.25, blake2b="b" * 32)


@dataclass(repr=False)
class Bundle:
    """A session that is damaged again and again; too long to be printed."""

    folder: Path
    written: list[Record]
    whole: bytes

    def damaged(self, stream: bytes) -> tuple[list[Record], bool]:
        (self.folder / "stream.mcap").write_bytes(stream)
        _, read, complete = read_session(self.folder)
        return read, complete


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    folder = tmp_path_factory.mktemp("bundle") / "cut.paravol"
    written = record_all(folder, 130)
    return Bundle(folder, written, (folder / "stream.mcap").read_bytes())


@given(share=st.floats(0.001, 0.999))
def test_a_stream_cut_anywhere_gives_what_came_before(
    bundle: Bundle, share: float
) -> None:
    written = bundle.written
    cut = max(int(share * len(bundle.whole)), 9)
    read, complete = bundle.damaged(bundle.whole[:cut])
    assert read == written[: len(read)]
    assert not complete
    # Losing more than one flush interval would break the promise of the module.
    kept = cut / len(bundle.whole) * len(written)
    assert len(read) >= kept - 2 * 50 - 0.25 * len(written)


@given(position=st.floats(0.0, 0.999), bit=st.integers(0, 7))
def test_a_flipped_bit_costs_one_chunk_at_most(
    bundle: Bundle, position: float, bit: int
) -> None:
    """And gives no wrong record: a flip in the framing drops some, changes none.

    What follows the damage is read, and frames still show their own samples.
    """
    damaged = bytearray(bundle.whole)
    byte = max(int(position * len(bundle.whole)), 8)
    damaged[byte] ^= 1 << bit
    (bundle.folder / "stream.mcap").write_bytes(bytes(damaged))
    found = read_recording(bundle.folder)
    whole = [r for r in bundle.written if isinstance(r, SampleRecord)]
    there = [r for r in found.records if isinstance(r, SampleRecord)]
    # fifty records are a chunk: 25 samples, of them
    assert len(there) >= len(whole) - 25
    assert all(record in bundle.written for record in found.records)
    assert len(found.places) <= len(there)
    for number, place in found.places.items():
        assert there[place] == whole[number]
    if len(there) < len(whole):
        (damage,) = found.damages
        assert damage.first_byte <= byte < damage.end_byte
        assert damage.samples in (None, len(whole) - len(there))
        gone = [r.time_s for r in whole if r not in there]
        assert damage.from_s <= gone[0]
        assert gone[-1] <= max(damage.to_s, 1.3)


def test_recordings_without_numbers_keep_their_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of before: the index beside a lost chunk counts what was in it."""
    add = Writer.add_message

    def unnumbered(self: Writer, *words: Any, **named: Any) -> None:
        add(self, *words, **{**named, "sequence": 0})

    monkeypatch.setattr(Writer, "add_message", unnumbered)
    monkeypatch.setattr(writer, "_FLUSH_AFTER_S", 3600.0)
    record_all(tmp_path / "a.paravol", 130)
    stream = tmp_path / "a.paravol" / "stream.mcap"
    content = bytearray(stream.read_bytes())
    content[len(content) // 3] ^= 1
    stream.write_bytes(content)
    found = read_recording(tmp_path / "a.paravol")
    there = [r for r in found.records if isinstance(r, SampleRecord)]
    assert len(there) == 105
    assert found.complete
    (damage,) = found.damages
    assert damage.samples == 25
    assert damage.to_s - damage.from_s == pytest.approx(0.26)
    assert len(found.places) == 105
    for number, place in found.places.items():
        assert there[place] == SampleRecord.of(sample(number))


@pytest.mark.parametrize("byte", range(8, 160))
def test_no_byte_of_the_framing_asks_for_much_memory(bundle: Bundle, byte: int) -> None:
    """Lengths have eight bytes: a high one that is damaged speaks of exabytes."""
    damaged = bytearray(bundle.whole)
    damaged[byte] ^= 0x04
    read, _ = bundle.damaged(bytes(damaged))
    assert all(record in bundle.written for record in read)


def test_what_was_flushed_survives_without_close(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer, "_FLUSH_AFTER_S", 3600.0)
    recorder = SessionRecorder(tmp_path / "b.paravol", INFO)
    for i in range(60):
        recorder.add(SampleRecord.of(sample(i)))
    _, read, complete = read_session(tmp_path / "b.paravol")
    assert len(read) == 50
    assert not complete
    recorder.close()
    assert len(read_session(tmp_path / "b.paravol")[1]) == 60


def test_a_lone_record_does_not_wait_for_others(tmp_path: Path) -> None:
    """A device that falls silent keeps nothing from the disk."""
    with SessionRecorder(tmp_path / "b.paravol", INFO) as recorder:
        recorder.add(SampleRecord.of(sample(1)))
        stream = tmp_path / "b.paravol" / "stream.mcap"
        for _ in range(600):
            if read_session(stream.parent)[1]:
                break
            time.sleep(0.05)
        assert read_session(stream.parent)[1] == [SampleRecord.of(sample(1))]


def test_a_disk_that_refuses_is_told_by_the_next_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(self: SessionRecorder) -> None:
        refused.set()
        raise OSError(28, "No space left on device")

    refused = threading.Event()
    with SessionRecorder(tmp_path / "b.paravol", INFO) as recorder:
        monkeypatch.setattr(SessionRecorder, "flush", refuse)
        recorder.add(SampleRecord.of(sample(1)))
        assert refused.wait(60)
        with pytest.raises(OSError, match="No space left"):
            recorder.add(SampleRecord.of(sample(2)))


def test_a_full_disk_costs_what_comes_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody who is told of it goes on; each sample is counted all the same."""
    told: list[OSError] = []
    has_room = [True]
    flush = SessionRecorder.flush

    def filled(self: SessionRecorder) -> None:
        if not has_room[0]:
            raise OSError(28, "No space left on device")
        flush(self)

    monkeypatch.setattr(SessionRecorder, "flush", filled)
    with SessionRecorder(tmp_path / "b.paravol", INFO, told.append) as recorder:
        for number in range(60):
            has_room[0] = number < 52
            recorder.add(SampleRecord.of(sample(number)))
            if number == 51:
                recorder.flush()
        recorder._flusher.join(60)
        for number in range(60, 200):
            recorder.add(SampleRecord.of(sample(number)))
        assert recorder.samples == 200
        recorder.close({"score": 1})
    assert len(told) == 1
    assert told[0].errno == 28
    _, records, complete = read_session(tmp_path / "b.paravol")
    assert records[:52] == [SampleRecord.of(sample(n)) for n in range(52)]
    assert not complete
    assert not (tmp_path / "b.paravol" / "result.json").exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no disk that is full")
def test_a_disk_without_any_room_raises_nothing_where_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[OSError] = []
    monkeypatch.setattr(
        writer,
        "open",
        lambda file, mode: open("/dev/full", mode),  # noqa: SIM115 (the recorder's)
        raising=False,
    )
    with pytest.raises(OSError, match="No space left"):
        SessionRecorder(tmp_path / "a.paravol", INFO, told.append)


def killed(folder: Path, kills: int) -> list[dict[str, float]]:
    """Kill processes that record, at random moments; see `killed_recorders.py`."""
    words = "-m", "tests.scenarios.killed_recorders", str(folder), str(kills)
    ended = subprocess.run(
        [sys.executable, *words],
        capture_output=True,
        text=True,
        timeout=500,
        cwd=Path(__file__).parents[2],
        check=True,
    )
    return [json.loads(line) for line in ended.stdout.splitlines()]


@pytest.mark.parametrize("kills", [2, *slow(24)])
def test_a_kill_costs_half_a_second(tmp_path: Path, kills: int) -> None:
    """What was added half a second before the kill is there, and nothing else is."""
    for number, told in enumerate(killed(tmp_path, kills)):
        found = read_recording(tmp_path / f"{number}.paravol")
        samples = [r for r in found.records if isinstance(r, SampleRecord)]
        assert [r.buttons for r in samples] == [i % 128 for i in range(len(samples))]
        assert not found.complete
        assert told["killed_s"] > 0.5
        last_s = samples[-1].time_s if samples else 0.0
        assert told["added_s"] - last_s <= 0.5
        # rare edits and frames are as safe as samples
        frames = [r for r in found.records if isinstance(r, FrameRecord)]
        assert len(frames) >= len(samples) // 5 - 1


@pytest.mark.parametrize("length", range(8))
def test_a_stream_that_was_only_opened_is_an_empty_one(
    bundle: Bundle, length: int
) -> None:
    read, complete = bundle.damaged(bundle.whole[:length])
    assert read == []
    assert not complete


def test_a_clock_that_runs_backwards_is_kept_as_it_was(tmp_path: Path) -> None:
    times = [0.0, 0.01, 5.0, -3.0, 0.02, 0.02, 0.03]
    with SessionRecorder(tmp_path / "b.paravol", INFO) as recorder:
        for i, time_s in enumerate(times):
            recorder.add(
                msgspec.structs.replace(SampleRecord.of(sample(i)), time_s=time_s)
            )
    found = read_recording(tmp_path / "b.paravol")
    assert [r.time_s for r in found.records if isinstance(r, SampleRecord)] == times
    assert found.complete
    assert not found.damages


def test_result_is_written_last(tmp_path: Path) -> None:
    recorder = SessionRecorder(tmp_path / "c.paravol", INFO)
    assert not (tmp_path / "c.paravol" / "result.json").exists()
    recorder.close({"frames": 3})
    recorder.close({"frames": 4})
    text = (tmp_path / "c.paravol" / "result.json").read_text()
    assert '"frames": 3' in text


def test_a_full_folder_is_not_overwritten(tmp_path: Path) -> None:
    record_all(tmp_path / "d.paravol", 1)
    with pytest.raises(ValueError, match="already holds a session"):
        SessionRecorder(tmp_path / "d.paravol", INFO)


@pytest.mark.parametrize("content", [None, b"{", b'{"unknown": 1}'])
def test_no_session_is_one_sentence(tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / "session.json").write_bytes(content)
    with pytest.raises(ValueError, match=r"session\.json"):
        read_session(tmp_path)


def test_a_stream_of_something_else_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "e.paravol"
    record_all(folder, 1)
    (folder / "stream.mcap").write_bytes(b"GIF89a, not a stream at all")
    with pytest.raises(ValueError, match="not an MCAP stream"):
        read_session(folder)


def test_two_threads_may_add_to_one_recording(tmp_path: Path) -> None:
    """Samples from one, frames from the other; each keeps its own order."""
    count = 300

    def frames() -> None:
        for i in range(count):
            recorder.add(FrameRecord(i, i, 1.0, 0.25, "a" * 32))

    with SessionRecorder(tmp_path / "a.paravol", INFO) as recorder:
        other = threading.Thread(target=frames)
        other.start()
        for i in range(count):
            recorder.add(SampleRecord.of(sample(i)))
        other.join(timeout=60)
    _, read, complete = read_session(tmp_path / "a.paravol")
    assert complete
    assert len(read) == 2 * count
    assert [r.number for r in read if isinstance(r, FrameRecord)] == list(range(count))
    times = [r.time_s for r in read if isinstance(r, SampleRecord)]
    assert times == sorted(times)
    assert len(times) == count


def test_a_recording_from_before_visible_sets_were_named_had_them() -> None:
    fields = msgspec.to_builtins(INFO)
    del fields["visible_sets"]
    assert msgspec.convert(fields, SessionInfo).visible_sets
    plain = msgspec.structs.replace(INFO, visible_sets=False)
    assert not msgspec.convert(msgspec.to_builtins(plain), SessionInfo).visible_sets


def test_a_place_that_there_is_not_comes_back_as_none(tmp_path: Path) -> None:
    """Not a number is null in JSON; it costs no chunk."""
    nowhere = np.full(3, np.nan)
    pose = np.eye(4)
    pose[0, 3] = np.nan
    lost = Sample(1.0, pose, 0.0, nowhere, nowhere, 0)
    with SessionRecorder(tmp_path / "a", INFO) as recorder:
        recorder.add(SampleRecord.of(lost))
    recording = read_recording(tmp_path / "a")
    assert recording.damages == ()
    (record,) = recording.records
    assert isinstance(record, SampleRecord)
    again = record.sample()
    np.testing.assert_array_equal(again.device_from_tip, pose)
    np.testing.assert_array_equal(again.instrument_tip_mm, nowhere)


@pytest.mark.parametrize("text", ["nonsense", "{}"])
def test_a_session_of_no_exercise_is_told(text: str) -> None:
    info = msgspec.structs.replace(INFO, scenario=text)
    with pytest.raises(UserError, match=r"the exercise in session\.json"):
        info.exercise()


def test_a_registration_has_sixteen_numbers(tmp_path: Path) -> None:
    info = msgspec.structs.replace(INFO, world_from_device=[1.0] * 5)
    with SessionRecorder(tmp_path / "a", info):
        pass
    with pytest.raises(UserError, match="16 numbers, got 5"):
        read_recording(tmp_path / "a")


def rewrite(source: Path, target: Path, **options: Any) -> None:
    """Write a stream anew, as other tools do, with the library's own writer."""
    with source.open("rb") as read, target.open("wb") as written:
        writer = Writer(written, **options)
        writer.start()
        numbers: dict[int, int] = {}
        for schema, channel, message in make_reader(read).iter_messages():
            assert schema is not None
            if channel.id not in numbers:
                # a channel of somebody else shifts the numbers
                if not numbers:
                    writer.register_channel("/other", "json", 0)
                number = writer.register_schema(
                    schema.name, schema.encoding, schema.data
                )
                numbers[channel.id] = writer.register_channel(
                    channel.topic, "json", number
                )
            writer.add_message(
                numbers[channel.id], message.log_time, message.data,
                message.publish_time, message.sequence,
            )  # fmt: skip
        writer.finish()  # type: ignore[no-untyped-call]


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.ZSTD, "chunk_size": 3000},
        {"compression": CompressionType.ZSTD, "enable_crcs": False},
        {"use_chunking": False},
    ],
)
def test_a_stream_that_another_tool_wrote_anew_is_the_same(
    tmp_path: Path, options: dict[str, Any]
) -> None:
    record_all(tmp_path / "a", 527)
    before = read_recording(tmp_path / "a")
    rewrite(tmp_path / "a" / "stream.mcap", tmp_path / "new.mcap", **options)
    (tmp_path / "new.mcap").replace(tmp_path / "a" / "stream.mcap")
    after = read_recording(tmp_path / "a")
    assert sorted(map(repr, after.records)) == sorted(map(repr, before.records))
    assert (after.places, after.hash) == (before.places, before.hash)
    assert (after.complete, after.damages) == (True, ())
    # cut off, it gives what came before
    content = (tmp_path / "a" / "stream.mcap").read_bytes()
    (tmp_path / "a" / "stream.mcap").write_bytes(content[: len(content) // 2])
    half = read_recording(tmp_path / "a")
    assert not half.complete
    assert len(half.records) < len(after.records)


@given(st.lists(st.binary(max_size=4), max_size=6), st.data())
def test_a_streams_hash_knows_its_records_and_not_their_order(
    records: list[bytes], data: st.DataObject
) -> None:
    def hashed(those: list[bytes]) -> str:
        made = StreamHash()
        for record in those:
            made.add(record)
        return made.hexdigest()

    assert hashed(data.draw(st.permutations(records))) == hashed(records)
    for place, record in enumerate(records):
        changed = [*records[:place], record + b"!", *records[place + 1 :]]
        assert hashed(changed) != hashed(records)
        # one that stands twice is not one that stands never
        assert hashed([*records, record, record]) != hashed(records)
