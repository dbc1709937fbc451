import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from devices.microscribe.kinematics.profiles import DX40937
from devices.microscribe.wire import identity
from devices.microscribe.wire.identity import (
    Maxima,
    decode_words,
    encode_words,
    readable,
)
from devices.port import DeviceError, DeviceReason

# As a real arm sent them.
MAXIMA = "03 3F FF 00 00 00 00 00 00 00 00 00 3F FF 3F FF 1F FF 0F FF 0F FF 00 00"


def test_maxima_of_a_real_arm() -> None:
    maxima = Maxima.decode(bytes.fromhex(MAXIMA))
    assert maxima == DX40937.maxima
    assert maxima.counts_per_turn == (16384, 16384, 8192, 4096, 4096, 1)
    assert maxima.encode() == bytes.fromhex(MAXIMA)


@given(st.lists(st.integers(0, 0xFFFF), min_size=7, max_size=7))
def test_maxima_keep_timer_and_encoders_apart(values: list[int]) -> None:
    encoders = tuple(value or 1 for value in values[1:])
    maxima = Maxima(3, values[0], (0,) * 8, encoders)
    assert Maxima.decode(maxima.encode()) == maxima


@pytest.mark.parametrize("length", [0, 23, 25])
def test_maxima_of_another_length_are_refused(length: int) -> None:
    with pytest.raises(DeviceError, match="24") as caught:
        Maxima.decode(bytes(length))
    assert caught.value.reason is DeviceReason.UNSUPPORTED_FORMAT


def test_an_arm_without_encoders_is_refused() -> None:
    with pytest.raises(DeviceError, match="no encoder"):
        Maxima.decode(bytes(24))


@pytest.mark.parametrize("length", [0, 35, 37, 255])
def test_blocks_of_another_length_are_refused(length: int) -> None:
    with pytest.raises(DeviceError, match="instead of 36"):
        decode_words(bytes(length), 18, "parameters")


@given(st.lists(st.integers(-32768, 32767), max_size=20))
@example([-16382, -401])
def test_words_survive(words: list[int]) -> None:
    assert decode_words(encode_words(tuple(words)), len(words), "x") == tuple(words)
    assert encode_words((-16382, -401)) == bytes.fromhex("C0 02 FE 6F")


def test_strings_are_plain_text() -> None:
    assert identity.decode_string(b"HCI 2.0") == "HCI 2.0"
    with pytest.raises(DeviceError, match="plain text"):
        identity.decode_string(b"HCI\xff")


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "nothing"),
        (b"IBOX", "'IBOX'"),
        (b"it's", "'it's'"),
        (b"IB\xe9X", "the bytes 49 42 E9 58"),
        (b"MSCR\0", "the bytes 4D 53 43 52 00"),
        (b"x" * 42, f"'{'x' * 40}' and 2 bytes more"),
    ],
)
def test_bytes_are_told_as_text_where_they_are_text(data: bytes, told: str) -> None:
    assert readable(data) == told
