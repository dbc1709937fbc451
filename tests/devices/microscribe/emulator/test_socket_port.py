import select
import socket

import pytest

from devices.microscribe.emulator.socket_port import SocketPort, parse_address


def connect(port: SocketPort) -> socket.socket:
    host, number = port.name.removeprefix("socket://").split(":")
    client = socket.create_connection((host, int(number)), 5.0)
    client.settimeout(5.0)
    return client


def hear(port: SocketPort) -> bytes:
    select.select(port.sources(), [], [], 5.0)
    return port.read()


def served() -> tuple[SocketPort, socket.socket]:
    port = SocketPort(("127.0.0.1", 0))
    client = connect(port)
    assert hear(port) == b"", "somebody knocked"
    return port, client


@pytest.mark.parametrize(
    ("text", "address"),
    [("0", ("127.0.0.1", 0)), ("4455", ("127.0.0.1", 4455)), ("h:1", ("h", 1))],
)
def test_only_this_machine_unless_a_host_is_named(
    text: str, address: tuple[str, int]
) -> None:
    assert parse_address(text) == address


@pytest.mark.parametrize("text", ["", "x", ":1", "h:", "h:x", "65536", "-1"])
def test_other_addresses_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="PORT or HOST:PORT"):
        parse_address(text)


def test_bytes_pass_both_ways() -> None:
    port, client = served()
    client.sendall(b"\x03")
    assert hear(port) == b"\x03"
    port.write(b"\x83\x00")
    assert client.recv(9) == b"\x83\x00"
    assert port.client_rate() is None
    client.close()
    port.close()


def test_a_client_may_leave_and_another_come() -> None:
    port, client = served()
    client.close()
    assert hear(port) == b""
    port.write(b"lost")
    other = connect(port)
    hear(port)
    port.write(b"found")
    assert other.recv(9) == b"found"
    other.close()
    port.close()


def test_a_second_client_at_the_same_time_is_sent_away() -> None:
    port, first = served()
    second = connect(port)
    hear(port)
    assert second.recv(1) == b""
    port.write(b"x")
    assert first.recv(1) == b"x"
    for end in (first, second):
        end.close()
    port.close()


def test_pulled_it_ends_the_connection() -> None:
    port, client = served()
    before = port.name
    port.pull()
    assert client.recv(1) == b""
    assert port.sources() == []
    with pytest.raises(OSError, match="not plugged"):
        assert port.name
    port.plug()
    assert port.name.startswith("socket://127.0.0.1:")
    assert before.startswith("socket://127.0.0.1:")
    client.close()
    port.close()
    port.close()


def test_a_port_in_use_is_one_sentence() -> None:
    port = SocketPort(("127.0.0.1", 0))
    number = int(port.name.rpartition(":")[2])
    with pytest.raises(ValueError, match=f"cannot listen at 127.0.0.1:{number}"):
        SocketPort(("127.0.0.1", number))
    port.close()
