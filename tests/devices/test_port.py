import pytest

from devices.port import Closing, HostClock


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
