import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe import commands
from devices.microscribe.commands import Command, every_fixed_command
from devices.microscribe.emulator_state import FarEnd
from devices.microscribe.packets import Layout
from devices.microscribe.profiles import DX40937

# Every code whose top bit is set has a twin without it.
FORBIDDEN = {0xC3, 0xC7, 0xD0, 0xD1, 0xC4, 0xC1, 0xD2}
ASKED = {0xC0, 0xC2, 0xC5, 0xC6, *range(0xC8, 0xCF), 0xD3}
POLLS = {c for c in range(0x40) if not c & 0x10}


class _Arm:
    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        return (0,) * 6, 0

    def home(self) -> None:
        pass


def _every_command() -> list[Command]:
    streams = [
        commands.stream(Layout(code), ticks)
        for code in (0x00, 0x03, 0x23, 0x2F)
        for ticks in (0, 0xC3C7, 0xD0D1)
    ]
    return [*sorted(every_fixed_command(), key=lambda c: c.data), *streams]


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


def test_longer_commands_are_the_four_kinds() -> None:
    longer = {c.data for c in every_fixed_command() if len(c.data) > 1}
    assert longer == {b"\xc5IMMC", b"BEGIN", bytes(26)}


@pytest.mark.parametrize("first", _every_command(), ids=lambda c: c.data[:6].hex())
def test_no_two_commands_write_the_calibration_memory(first: Command) -> None:
    for second in _every_command():
        far_end = FarEnd(DX40937, _Arm(), 0.0)
        far_end.receive(b"IMMCBEGIN", 0.0)
        far_end.receive(first.data, 0.0)
        far_end.receive(second.data, 0.0)
        assert far_end.memory_writes == 0


@given(st.binary(max_size=30))
def test_anything_else_cannot_be_built(data: bytes) -> None:
    if data in {c.data for c in _every_command()}:
        return
    if len(data) == 25 and data[0] == 0xCF:
        return
    with pytest.raises(ValueError, match="no command the host may send"):
        Command(data)


@pytest.mark.parametrize("at", range(4, 25))
def test_a_stream_has_no_thresholds(at: int) -> None:
    data = bytearray(commands.stream(Layout(0x23), 9).data)
    data[at] = 1
    with pytest.raises(ValueError, match="no command"):
        Command(bytes(data))


def test_stream_bytes_and_limits() -> None:
    assert commands.stream(Layout(0x23), 9).data == b"\xcf\x00\x09\x23" + bytes(21)
    with pytest.raises(ValueError, match=r"0\.\.65535"):
        commands.stream(Layout(0x23), 1 << 16)
    with pytest.raises(ValueError, match="no command"):
        commands.poll(Layout(0x13))
