from collections.abc import Iterator
from itertools import permutations, product
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.emulator.emulated_line import misread
from devices.microscribe.emulator.firmware import rate_of_code
from devices.microscribe.wire import commands
from devices.microscribe.wire.commands import ALLOWED, Command
from devices.microscribe.wire.packets import PacketLayout
from devices.microscribe.wire.sign_on import RATES

MEMORY_WRITES = {0xC3, 0xC7, 0xD0, 0xD1}
# Every code whose top bit is set has a twin without it.
FORBIDDEN = MEMORY_WRITES | {0xC4, 0xC1, 0xD2}
ASKED = {0xC0, 0xC2, 0xC5, 0xC6, *range(0xC8, 0xCF), 0xD3}
POLLS = {c for c in range(0x40) if not c & 0x10}
EVERYTHING = [Command(data) for data in sorted(ALLOWED)]


def test_single_bytes_are_exactly_the_harmless_ones() -> None:
    allowed = set()
    for byte in range(256):
        try:
            Command(bytes((byte,)))
        except ValueError:
            continue
        allowed.add(byte)
    assert allowed == ASKED | POLLS
    assert not allowed & {code | bit for code in FORBIDDEN for bit in (0, 0x80)}
    assert not allowed & {code & 0x7F for code in FORBIDDEN}


def test_everything_that_can_be_said() -> None:
    longer = {command.data for command in EVERYTHING if len(command.data) > 1}
    streams = {b"\xcf\x00" + bytes((ticks, 0x23)) + bytes(21) for ticks in range(16)}
    clear = b"\x80\x00" + b"\xc5" * 35
    assert longer == {b"\xc5IMMC", b"BEGIN", clear} | streams
    assert len(EVERYTHING) == len(ASKED | POLLS) + 3 + 16


@given(st.binary(max_size=30))
def test_anything_else_cannot_be_built(data: bytes) -> None:
    if data in {command.data for command in EVERYTHING}:
        return
    with pytest.raises(ValueError, match="no command the host may send"):
        Command(data)


@pytest.mark.parametrize("at", range(4, 25))
def test_a_stream_has_no_thresholds(at: int) -> None:
    data = bytearray(commands.stream(9).data)
    data[at] = 1
    with pytest.raises(ValueError, match="no command"):
        Command(bytes(data))


def test_stream_bytes_and_limits() -> None:
    assert commands.stream(9).data == b"\xcf\x00\x09\x23" + bytes(21)
    for ticks in (-1, 16, 67, 1 << 16):
        with pytest.raises(ValueError, match=r"0\.\.15"):
            commands.stream(ticks)
    with pytest.raises(ValueError, match="no command"):
        commands.poll(PacketLayout(0x13))


class _Ear(NamedTuple):
    """A device's parser as the vendor's manual tells it, and no more than that."""

    mode: str
    """SYNC, WAIT, RUN (idle or streaming), ARGS or PASSWORD."""
    word: bytes = b""
    """The part of IMMC or BEGIN that has been heard."""
    wanted: int = 0
    command: int = 0
    number: bool = True
    """Whether what was heard of a password may be a serial number: letters and digits,
    at least one digit. We have none to say; a dead host may have said some."""


class _Heard(NamedTuple):
    ear: _Ear
    event: str = ""


def _longest(word: bytes, heard: bytes) -> bytes:
    """The longest end of ``heard`` with which ``word`` begins."""
    ends = (heard[i:] for i in range(len(heard)))
    return next((end for end in ends if word.startswith(end)), b"")


def _hear(ear: _Ear, byte: int) -> _Heard:
    if ear.mode in ("SYNC", "WAIT"):
        heard = ear.word + bytes((byte,))
        if heard.endswith(b"IMMC"):
            return _Heard(_Ear("WAIT"), "echo")
        if ear.mode == "WAIT" and heard.endswith(b"BEGIN"):
            return _Heard(_Ear("RUN"), "open")
        words = (b"IMMC", b"BEGIN") if ear.mode == "WAIT" else (b"IMMC",)
        best = max((_longest(word, heard) for word in words), key=len)
        return _Heard(_Ear(ear.mode, best))
    if ear.mode == "ARGS":
        wanted = ear.wanted - 1
        if ear.command == 0xCF and ear.wanted == 22 and byte & 0b11 == 0b10:
            wanted += 2
        if wanted:
            return _Heard(_Ear("ARGS", b"", wanted, ear.command))
        return _Heard(_Ear("RUN"), "new rate" if ear.command == 0xC4 else "")
    if ear.mode == "PASSWORD":
        if byte == 0:
            return _Heard(_Ear("RUN"), "memory written" if ear.number else "refused")
        # Any number with a digit in it, whatever letters stand around.
        fits = ear.number and chr(byte).isalnum() and byte < 0x80
        return _Heard(_Ear("PASSWORD", command=ear.command, number=fits))
    code = byte | 0x80
    if not byte & 0x40:
        return _Heard(_Ear("RUN"))
    if code == 0xC2:
        return _Heard(_Ear("RUN"), "homed")
    if code == 0xC5:
        return _Heard(_Ear("SYNC"))
    if code in MEMORY_WRITES:
        return _Heard(_Ear("PASSWORD", command=code, number=False), "password")
    if code in (0xC4, 0xD2, 0xCF):
        return _Heard(_Ear("ARGS", b"", 24 if code == 0xCF else 1, code))
    return _Heard(_Ear("RUN"))


def _say(ear: _Ear, data: bytes) -> Iterator[tuple[str, _Ear]]:
    """Everything that happens to the device while it hears one command."""
    for byte in data:
        ear, event = _hear(ear, byte)
        yield event, ear


def _reach(starts: set[_Ear], said: list[Command]) -> tuple[set[_Ear], set[str]]:
    """All states and events that any sequence of commands can lead to."""
    known, new = set(starts), list(starts)
    events: set[str] = set()
    while new:
        ear = new.pop()
        for command in said:
            said_of = list(_say(ear, command.data))
            events.update(event for event, _ in said_of)
            after = said_of[-1][1] if said_of else ear
            if after not in known:
                known.add(after)
                new.append(after)
    return known, events


def test_no_sequence_of_commands_asks_for_the_password() -> None:
    """From every state that a live session knows, with timeouts at any place.

    BEGIN is left out: only an echo allows it, see the test of its own.
    """
    said = [command for command in EVERYTHING if command != commands.BEGIN]
    known, events = _reach({_Ear("SYNC"), _Ear("WAIT"), _Ear("RUN")}, said)
    assert {ear.mode for ear in known} == {"SYNC", "WAIT", "RUN"}
    assert not events & {"password", "memory written", "new rate"}


def test_begin_in_an_open_session_would_home_it_but_writes_nothing() -> None:
    happened = [event for event, _ in _say(_Ear("RUN"), commands.BEGIN_BYTES) if event]
    assert happened == ["homed"]
    assert [e for e, _ in _say(_Ear("WAIT"), commands.BEGIN_BYTES) if e] == ["open"]


def _left_behind() -> set[_Ear]:
    """Whatever a dead host may have left half said, granted passwords included."""
    half = {_Ear("ARGS", b"", n, 0xCF) for n in range(1, 27)}
    half |= {_Ear("ARGS", b"", 1, code) for code in (0xC4, 0xD2)}
    for code, count in {0xC3: 14, 0xC7: 36, 0xD0: 14}.items():
        half |= {_Ear("ARGS", b"", n, code) for n in range(1, count + 1)}
    for code, number in product(MEMORY_WRITES, (True, False)):
        half.add(_Ear("PASSWORD", command=code, number=number))
    half |= {_Ear("SYNC", b"IMMC"[:n]) for n in range(4)}
    half |= {_Ear("WAIT", b"BEGIN"[:n]) for n in range(5)}
    return half | {_Ear("RUN")}


HARM = {"homed", "password", "memory written"}


def test_no_sequence_of_commands_writes_the_memory_whatever_was_left_behind() -> None:
    """Every search begins by clearing, with a byte that no serial number has."""
    after_first = {
        list(_say(ear, commands.CLEAR_BYTES))[-1][1] for ear in _left_behind()
    }
    known, events = _reach(after_first, EVERYTHING)
    assert {ear.mode for ear in known} == {"SYNC", "WAIT", "RUN"}
    assert "memory written" not in events


def test_clearing_brings_any_state_to_listening_without_harm() -> None:
    refused = 0
    for ear in _left_behind():
        said = list(_say(ear, commands.CLEAR_BYTES))
        assert said[-1][1].mode in ("SYNC", "WAIT"), ear
        events = {event for event, _ in said}
        assert not events & HARM, ear
        # The rate that a dead host did not say becomes the first one that is tried.
        assert "new rate" not in events or ear.command == 0xC4
        refused += "refused" in events
    assert refused == 8
    assert rate_of_code(commands.CLEAR_BYTES[0]) == RATES[0]


def test_no_search_sets_the_home_whatever_was_left_behind() -> None:
    """The letters of a sign-on find an arm that listens, however often repeated."""
    cleared = {list(_say(ear, commands.CLEAR_BYTES))[-1][1] for ear in _left_behind()}
    known, events = _reach(cleared, [commands.SIGN_ON, commands.CLEAR])
    assert {ear.mode for ear in known} == {"SYNC", "WAIT"}
    assert not events & (HARM | {"new rate"})
    # Without clearing they do not, which shows that this test can fail.
    _, bare = _reach(_left_behind(), [commands.SIGN_ON])
    assert "password" in bare


def test_no_byte_is_a_digit() -> None:
    """A serial number has some; this alone keeps the memory from being written."""
    said = {byte for command in EVERYTHING for byte in command.data}
    assert not said & set(b"0123456789")


@pytest.mark.parametrize(("ours", "theirs"), [*permutations(RATES, 2)])
def test_a_search_at_the_wrong_rate_is_harmless_to_an_open_session(
    ours: int, theirs: int
) -> None:
    """Nothing that is misread is a dangerous code, wherever a command may begin.

    Even for an arm that keeps bytes with framing errors. At 1.5 times our rate such an
    arm may read "set parameters" out of the letters; it then asks for a password that
    is never said.
    """
    clear, sign_on = commands.CLEAR_BYTES, commands.SIGN_ON_BYTES
    for said in (clear, sign_on, commands.BEGIN_BYTES, b"\0"):
        kept = {byte | 0x80 for byte in misread(said, ours, theirs, True)}
        dangerous = kept & (MEMORY_WRITES | {0xC2, 0xC4})
        misleading = said in (clear, sign_on) and 2 * theirs == 3 * ours
        assert dangerous <= ({0xC7} if misleading else set())
        heard = misread(said, ours, theirs)
        assert not {byte | 0x80 for byte in heard} & MEMORY_WRITES
        for ear in _left_behind():
            events = {event for event, _ in _say(ear, heard)}
            assert not events & {"homed", "password"}
