import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.port import Closing, DeviceError, DeviceReason, HostClock
from tests.devices.memory_port import memory_port_pair


@given(st.lists(st.binary(max_size=20), max_size=10))
def test_one_end_reads_what_the_other_wrote(chunks: list[bytes]) -> None:
    near, far = memory_port_pair()
    for chunk in chunks:
        near.write(chunk)
    total = b"".join(chunks)
    assert far.read(len(total) + 1, 0.0) == total
    assert near.read(1, 0.0) == b""


def test_reading_waits_for_the_far_end() -> None:
    near, far = memory_port_pair()
    writer = threading.Timer(0.02, far.write, (b"ab",))
    writer.start()
    assert near.read(2, 5.0) == b"ab"
    writer.join()


def test_what_was_written_before_closing_is_still_read() -> None:
    near, far = memory_port_pair("line")
    far.write(b"x")
    far.close()
    assert near.read(5, 0.0) == b"x"
    with pytest.raises(DeviceError, match="line") as caught:
        near.read(1, 0.0)
    assert caught.value.reason is DeviceReason.DISCONNECTED
    with pytest.raises(DeviceError):
        near.write(b"y")


def test_reset_input_drops_and_counts() -> None:
    near, far = memory_port_pair()
    far.write(b"abc")
    assert near.reset_input() == 3
    assert near.read(1, 0.0) == b""


def test_what_waits_can_be_told_and_read_as_a_burst() -> None:
    near, far = memory_port_pair()
    far.write(b"abc")
    assert near.waiting == 3
    assert near.read_burst(10, 5.0, 0.0) == b"abc"
    assert near.read_burst(10, 0.0, 0.0) == b""
    far.write(b"abcd")
    assert near.read_burst(2, 5.0, 5.0) == b"ab"
    far.close()
    near.read(2, 0.0)
    with pytest.raises(DeviceError):
        _ = near.waiting


@given(st.lists(st.binary(min_size=1, max_size=20), min_size=1, max_size=10))
def test_some_is_all_that_is_there(chunks: list[bytes]) -> None:
    near, far = memory_port_pair()
    for chunk in chunks:
        near.write(chunk)
    near.close()
    assert far.read_some(1, 5.0) == b"".join(chunks)
    with pytest.raises(DeviceError):
        far.read_some(1, 0.0)


def test_some_waits_for_the_least() -> None:
    near, far = memory_port_pair()
    near.write(b"a")
    assert far.read_some(3, 0.0) == b"a"
    writer = threading.Timer(0.02, near.write, (b"bcd",))
    near.write(b"a")
    writer.start()
    assert far.read_some(4, 5.0) == b"abcd"
    writer.join()


def test_the_hosts_clock_goes_on() -> None:
    clock = HostClock()
    begin = clock.now()
    clock.sleep(0.001)
    assert clock.now() >= begin + 0.001


class Door(Closing):
    def __init__(self) -> None:
        self.closed = 0

    def close(self) -> None:
        self.closed += 1


def test_with_closes_and_gives_the_thing_itself() -> None:
    door = Door()
    with door as same:
        assert same is door
        assert door.closed == 0
    assert door.closed == 1


def test_an_error_closes_too_and_goes_on() -> None:
    door = Door()

    def slam() -> None:
        with door:
            raise KeyError("key")

    with pytest.raises(KeyError):
        slam()
    assert door.closed == 1
