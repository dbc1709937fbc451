import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.commands import Query
from devices.microscribe.emulator_state import FarEnd
from devices.microscribe.packets import Layout
from devices.microscribe.profiles import DX40937, HOME_COUNTS
from devices.microscribe.protocol import (
    TRANSITIONS,
    BadReply,
    Event,
    HostSession,
    ProductId,
    ProtocolError,
    Reply,
    Sample,
    State,
    Step,
    SyncEcho,
)

POSE = Layout(0x23)
PACKET = bytes.fromhex("A3 01 7F 7F 6C 4F 30 5E 35 54 20 02 18 79 41 60")


class _Arm:
    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        return HOME_COUNTS, 1

    def home(self) -> None:
        pass


def _idle() -> HostSession:
    session = HostSession()
    session.sign_on()
    session.receive(b"IMMC")
    session.begin()
    session.receive(b"MSCR\0")
    assert session.state is State.IDLE
    return session


def _one_by_one(session: HostSession, data: bytes) -> list[Event]:
    return [event for byte in data for event in session.receive(bytes((byte,)))]


def test_a_whole_session_with_the_emulated_far_end() -> None:
    """Both state machines joined in memory, every byte on its own."""
    far_end, session = FarEnd(DX40937, _Arm(), 0.0), HostSession()
    sent = [session.sign_on()]
    events = _one_by_one(session, far_end.receive(sent[-1].data, 0.0))
    assert events == [SyncEcho()]
    begin = session.begin()
    events = _one_by_one(session, far_end.receive(begin.data, 0.0))
    assert events == [ProductId(b"MSCR")]
    for query in Query:
        if query in (Query.END, Query.HOME):
            continue
        command = session.ask(query)
        (event,) = _one_by_one(session, far_end.receive(command.data, 0.0))
        assert isinstance(event, Reply)
        assert event.query is query
        assert event.payload
    poll = session.poll(POSE)
    (event,) = _one_by_one(session, far_end.receive(poll.data, 1.0))
    assert isinstance(event, Sample)
    assert event.packet.counts == HOME_COUNTS
    assert event.packet.timer == 900
    far_end.receive(session.end().data, 2.0)
    assert session.state is State.OFF
    assert session.stray == 0


def test_a_stream_and_its_end() -> None:
    far_end, session = FarEnd(DX40937, _Arm(), 0.0), HostSession()
    session.receive(far_end.receive(session.sign_on().data, 0.0))
    session.receive(far_end.receive(session.begin().data, 0.0))
    raw = far_end.receive(session.stream(POSE, 9).data, 0.0)
    raw += b"".join(far_end.advance(0.01 * i) for i in range(5))
    events = session.receive(raw)
    assert [type(event) for event in events] == [Sample] * 5
    assert session.counters.noise == 0
    raw = far_end.receive(session.poll(Layout(0)).data, 0.05)
    events = session.receive(raw)
    assert len(events) == 1
    assert session.state is State.IDLE


@given(st.binary(max_size=30).filter(lambda raw: b"IMMC" not in raw))
def test_attention_is_found_behind_any_noise(noise: bytes) -> None:
    session = HostSession()
    session.sign_on()
    # Noise that ends in a part of the word must not hide the word itself.
    for data in (noise, noise + b"I", noise + b"IMM"):
        session.sign_on()
        assert _one_by_one(session, data + b"IMMC") == [SyncEcho()]


def test_echoes_behind_the_first_are_dropped() -> None:
    session = HostSession()
    session.sign_on()
    assert session.receive(b"\xc5IMMCIMMC\xc5IMMC") == [SyncEcho()]
    session.begin()
    assert session.receive(b"IMMCMSCR\0") == [ProductId(b"IMMCMSCR")]


def test_replies_with_header_like_bytes_are_read_by_length() -> None:
    session = _idle()
    session.ask(Query.PARAMETERS)
    block = bytes([0xA3, 0xC0, 0xFF, 0x80] * 9)
    assert session.receive(b"\xc0\x24" + block) == [Reply(Query.PARAMETERS, block)]


def test_an_endless_string_ends() -> None:
    session = _idle()
    session.ask(Query.MODEL)
    (event,) = session.receive(b"\xca" + b"x" * 100)
    assert isinstance(event, BadReply)
    assert session.state is State.IDLE
    assert session.stray > 0


def test_a_late_packet_is_not_the_next_reply() -> None:
    session = _idle()
    session.poll(POSE)
    session.receive(PACKET[:9])
    session.abandon()
    session.receive(PACKET[9:])
    assert session.stray == 7
    session.ask(Query.MODEL)
    assert session.receive(PACKET + b"\xcaDX\0") == [Reply(Query.MODEL, b"DX")]


@given(st.binary(max_size=40))
def test_no_bytes_break_a_session(data: bytes) -> None:
    session = _idle()
    session.poll(POSE)
    events = session.receive(data)
    assert all(isinstance(event, Sample) for event in events)
    # Without a whole packet inside there is no sample.
    if len(data) < POSE.length or POSE.header not in data:
        assert events == []


def test_a_doubled_byte_is_seen_as_stray() -> None:
    session = _idle()
    session.poll(POSE)
    session.receive(PACKET[:5] + PACKET[4:])
    assert session.stray == 1


def test_begin_is_possible_only_after_attention_and_once() -> None:
    session = HostSession()
    with pytest.raises(ProtocolError, match="BEGIN is not possible in OFF"):
        session.begin()
    session.sign_on()
    session.receive(b"IMMC")
    session.begin()
    with pytest.raises(ProtocolError, match="SYNC--ECHO, SYNCED--BEGIN"):
        session.begin()


def test_every_state_can_be_reached_and_left() -> None:
    assert {target for target in TRANSITIONS.values()} == set(State)
    for state in State:
        assert TRANSITIONS[(state, Step.SIGN_ON)] is State.SYNC
        assert TRANSITIONS[(state, Step.END)] is State.OFF
    into_opening = [key for key, to in TRANSITIONS.items() if to is State.OPENING]
    assert into_opening == [(State.SYNCED, Step.BEGIN)]
