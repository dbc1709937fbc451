from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator.firmware import ArmFirmware
from devices.microscribe.emulator.motion import StillMotion
from devices.microscribe.kinematics.profiles import DX40937, HOME_COUNTS
from devices.microscribe.wire.commands import Query
from devices.microscribe.wire.packets import PacketLayout
from devices.microscribe.wire.protocol import (
    TRANSITIONS,
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
from tests.devices.microscribe.conftest import idle_session

POSE = PacketLayout(0x23)
PACKET = bytes.fromhex("A3 01 7F 7F 6C 4F 30 5E 35 54 20 02 18 79 41 60")


def _one_by_one(session: HostSession, data: bytes) -> list[Event]:
    return [event for byte in data for event in session.receive(bytes((byte,)))]


def test_a_whole_session_with_the_emulated_far_end() -> None:
    """Both state machines joined in memory, every byte on its own."""
    firmware, session = ArmFirmware(DX40937, StillMotion(DX40937), 0.0), HostSession()
    assert firmware.receive(session.clear().data, 0.0) == b""
    sent = [session.sign_on()]
    events = _one_by_one(session, firmware.receive(sent[-1].data, 0.0))
    assert events == [SyncEcho()]
    begin = session.begin()
    events = _one_by_one(session, firmware.receive(begin.data, 0.0))
    assert events == [ProductId(b"MSCR")]
    for query in Query:
        if query in (Query.END, Query.HOME):
            continue
        command = session.ask(query)
        (event,) = _one_by_one(session, firmware.receive(command.data, 0.0))
        assert isinstance(event, Reply)
        assert event.query is query
        assert event.payload
    poll = session.poll(POSE)
    (event,) = _one_by_one(session, firmware.receive(poll.data, 1.0))
    assert isinstance(event, Sample)
    assert event.packet.counts == HOME_COUNTS
    assert event.packet.timer == 900
    firmware.receive(session.end().data, 2.0)
    assert session.state is State.OFF
    assert session.stray == 0


def test_a_stream_and_its_end() -> None:
    firmware, session = ArmFirmware(DX40937, StillMotion(DX40937), 0.0), HostSession()
    session.clear()
    session.receive(firmware.receive(session.sign_on().data, 0.0))
    session.receive(firmware.receive(session.begin().data, 0.0))
    raw = firmware.receive(session.stream(9).data, 0.0)
    raw += b"".join(firmware.advance(0.01 * i) for i in range(5))
    events = session.receive(raw)
    assert [type(event) for event in events] == [Sample] * 5
    assert session.counters.noise == 0
    raw = firmware.receive(session.poll(PacketLayout(0)).data, 0.05)
    events = session.receive(raw)
    assert len(events) == 1
    assert session.state is State.IDLE


@given(st.binary(max_size=30).filter(lambda raw: b"IMMC" not in raw))
def test_attention_is_found_behind_any_noise(noise: bytes) -> None:
    session = HostSession()
    session.clear()
    session.sign_on()
    # Noise that ends in a part of the word must not hide the word itself.
    for data in (noise, noise + b"I", noise + b"IMM"):
        session.sign_on()
        assert _one_by_one(session, data + b"IMMC") == [SyncEcho()]


def test_echoes_behind_the_first_are_dropped() -> None:
    session = HostSession()
    session.clear()
    session.sign_on()
    assert session.receive(b"\xc5IMMCIMMC\xc5IMMC") == [SyncEcho()]
    session.begin()
    assert session.receive(b"IMMCMSCR\0") == [ProductId(b"IMMCMSCR")]


def test_replies_with_header_like_bytes_are_read_by_length() -> None:
    session = idle_session()
    session.ask(Query.PARAMETERS)
    block = bytes([0xA3, 0xC0, 0xFF, 0x80] * 9)
    assert session.receive(b"\xc0\x24" + block) == [Reply(Query.PARAMETERS, block)]


def test_a_late_packet_is_not_the_next_reply() -> None:
    session = idle_session()
    session.poll(POSE)
    session.receive(PACKET[:9])
    session.abandon()
    session.receive(PACKET[9:])
    assert session.stray == 7
    session.ask(Query.MODEL)
    assert session.receive(PACKET + b"\xcaDX\0") == [Reply(Query.MODEL, b"DX")]


@given(st.binary(max_size=40))
def test_no_bytes_break_a_session(data: bytes) -> None:
    session = idle_session()
    session.poll(POSE)
    events = session.receive(data)
    assert all(isinstance(event, Sample) for event in events)
    # Without a whole packet inside there is no sample.
    if len(data) < POSE.length or POSE.header not in data:
        assert events == []


def test_every_state_can_be_reached_and_left() -> None:
    assert {to for to in TRANSITIONS.values() if to is not None} == set(State)
    for state in State:
        assert TRANSITIONS[(state, Step.CLEAR)] is State.SYNC
        assert TRANSITIONS[(state, Step.END)] is State.OFF
    into_sync = {state for state in State if TRANSITIONS[state, Step.SIGN_ON]}
    assert into_sync == {State.SYNC, State.SYNCED}
    into_opening = [key for key, to in TRANSITIONS.items() if to is State.OPENING]
    assert into_opening == [(State.SYNCED, Step.BEGIN)]


def test_the_table_is_total() -> None:
    assert set(TRANSITIONS) == {(state, step) for state in State for step in Step}


_CALLS: dict[Step, Callable[[HostSession], object]] = {
    Step.CLEAR: HostSession.clear,
    Step.SIGN_ON: HostSession.sign_on,
    Step.BEGIN: HostSession.begin,
    Step.ASK: lambda session: session.ask(Query.MODEL),
    Step.POLL: lambda session: session.poll(POSE),
    Step.STREAM: lambda session: session.stream(9),
    Step.ABANDON: HostSession.abandon,
    Step.END: HostSession.end,
}
_HEARD: dict[State, tuple[Step, bytes]] = {
    State.SYNC: (Step.ECHO, b"IMMC"),
    State.OPENING: (Step.PRODUCT_ID, b"MSCR\0"),
    State.ASKED: (Step.REPLY, b"\xcaDX\0"),
    State.POLLED: (Step.PACKET, PACKET),
    State.STREAMING: (Step.PACKET, PACKET),
}


def _brought_to(state: State) -> HostSession:
    """A session led there by legal steps only."""
    session = HostSession()
    if state is State.OFF:
        return session
    session.clear()
    session.sign_on()
    if state is State.SYNC:
        return session
    session.receive(b"IMMC")
    if state is State.SYNCED:
        return session
    session.begin()
    if state is State.OPENING:
        return session
    session.receive(b"MSCR\0")
    into = {
        State.ASKED: Step.ASK,
        State.POLLED: Step.POLL,
        State.STREAMING: Step.STREAM,
    }
    if state in into:
        _CALLS[into[state]](session)
    return session


@pytest.mark.parametrize("step", list(_CALLS), ids=lambda step: step.name)
@pytest.mark.parametrize("state", list(State), ids=lambda state: state.name)
def test_every_step_from_every_state_is_as_tabled(state: State, step: Step) -> None:
    session = _brought_to(state)
    assert session.state is state
    target = TRANSITIONS[state, step]
    if target is None:
        with pytest.raises(ProtocolError, match=f"{step.name} is not possible"):
            _CALLS[step](session)
        assert session.state is state
    else:
        _CALLS[step](session)
        assert session.state is target


@pytest.mark.parametrize("state", list(State), ids=lambda state: state.name)
def test_every_answer_in_every_state_is_as_tabled(state: State) -> None:
    for step, raw in _HEARD.values():
        session = _brought_to(state)
        events = session.receive(raw)
        heard = _HEARD.get(state)
        if heard is not None and heard[0] is step:
            assert len(events) == 1
            assert session.state is TRANSITIONS[state, step]
        else:
            # The answer to another question moves nothing.
            assert not [e for e in events if not isinstance(e, ProductId)]
            assert session.state in (state, State.IDLE)


@pytest.mark.parametrize("glued", [b"", PACKET, PACKET * 2])
def test_a_streams_echo_may_be_glued_to_its_first_packet(glued: bytes) -> None:
    session = idle_session()
    session.stream(9)
    events = session.receive(b"\xcf" + glued)
    assert [type(event) for event in events] == [Sample] * (len(glued) // 16)
    assert session.stray == session.counters.noise == 0


def test_what_came_before_a_streams_echo_is_no_part_of_it() -> None:
    session = idle_session()
    session.stream(9)
    (event,) = session.receive(PACKET[3:] + PACKET + b"\xcf" + PACKET)
    assert isinstance(event, Sample)
    assert event.offset == session.received - 16
    assert session.stray == 13 + 16


@given(st.lists(st.integers(1, 30), max_size=10), st.integers(0, 3))
def test_offsets_count_every_byte_of_the_session(cuts: list[int], noise: int) -> None:
    session = idle_session()
    begin = session.received
    raw = b"\xcf" + (b"\x01" * noise + PACKET) * 5
    session.stream(9)
    events = []
    at = 0
    for cut in [*cuts, len(raw)]:
        events += session.receive(raw[at : at + cut])
        at += cut
    offsets = [event.offset for event in events if isinstance(event, Sample)]
    assert offsets == [begin + 1 + noise + i * (noise + len(PACKET)) for i in range(5)]


def test_confirmed_poses_wait_for_their_successor() -> None:
    session = idle_session(confirmed_only=True)
    session.stream(9)
    assert session.missing_bytes == 1 + 16 + 1
    assert session.receive(b"\xcf" + PACKET) == []
    assert session.missing_bytes == 1
    assert len(session.receive(PACKET[:1])) == 1
    # A poll has no successor to wait for.
    session.poll(POSE)
    assert len(session.receive(PACKET)) == 1
