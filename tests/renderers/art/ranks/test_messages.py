import contextlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.art.ranks.messages import (
    HEADER_BYTES,
    Message,
    MessageKind,
    ProtocolError,
    sequence_of,
    split_records,
)

messages = st.builds(
    Message,
    st.sampled_from(MessageKind),
    st.integers(0, 65535),
    st.integers(0, 65535),
    st.integers(0, 2**32 - 1),
    st.integers(0, 2**32 - 1),
    st.binary(max_size=200),
    *[st.integers(0, 2**32 - 1)] * 3,
)


@given(messages)
def test_a_message_survives_its_bytes(message: Message) -> None:
    record = message.encode()
    assert len(record) == HEADER_BYTES + len(message.payload)
    assert Message.decode(record) == message


@given(messages, st.integers(0, 2**40))
def test_a_message_carries_its_number(message: Message, number: int) -> None:
    record = message.encode(number)
    assert sequence_of(record) == number % 2**32
    assert Message.decode(record) == message


@given(message=messages, data=st.data())
def test_a_cut_or_damaged_message_is_refused(
    message: Message, data: st.DataObject
) -> None:
    record = bytearray(message.encode())
    cut = data.draw(st.integers(0, len(record) - 1))
    with pytest.raises(ProtocolError):
        Message.decode(bytes(record[:cut]))
    if message.payload:
        at = data.draw(st.integers(HEADER_BYTES, len(record) - 1))
        record[at] ^= 1 << data.draw(st.integers(0, 7))
        with pytest.raises(ProtocolError, match="damaged"):
            Message.decode(bytes(record))


@given(st.lists(messages, max_size=6))
def test_records_laid_end_to_end_come_apart(sent: list[Message]) -> None:
    bundle = b"".join(m.encode(n) for n, m in enumerate(sent))
    records = list(split_records(bundle))
    assert [Message.decode(record) for record in records] == sent
    assert [sequence_of(record) for record in records] == list(range(len(sent)))
    if sent:
        with pytest.raises(ProtocolError):
            [Message.decode(record) for record in split_records(bundle[:-1])]


def test_an_unknown_kind_is_refused() -> None:
    record = bytearray(Message(MessageKind.DATA, 0, 1, 1).encode())
    record[4] = 11
    with pytest.raises(ProtocolError, match="no message has kind 11"):
        Message.decode(bytes(record))
    record[0] ^= 255
    with pytest.raises(ProtocolError, match="does not begin like one"):
        Message.decode(bytes(record))


@given(st.binary(max_size=300))
def test_noise_is_refused_or_read_but_never_breaks(noise: bytes) -> None:
    with contextlib.suppress(ProtocolError):
        assert Message.decode(noise).encode() == noise


def test_the_header_keeps_its_places() -> None:
    message = Message(MessageKind.DATA, 0x0102, 0x0304, 0x05060708, 0x090A0B0C, b"x")
    header = np.frombuffer(message.encode()[:HEADER_BYTES], np.uint8)
    assert header[4] == 3
    assert header[6:20].tolist() == [2, 1, 4, 3, 0, 0, 12, 11, 10, 9, 8, 7, 6, 5]
