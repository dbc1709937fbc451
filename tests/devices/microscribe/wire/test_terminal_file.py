import os
import socket
import sys
import threading
import time
from collections.abc import Iterator

import pytest

from devices.microscribe.wire.terminal_file import SocketFile, TerminalFile

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="pseudo-terminals need POSIX"
)


@pytest.fixture(params=["terminal", "socket"])
def ends(request: pytest.FixtureRequest) -> Iterator[tuple[int, TerminalFile]]:
    """The far end's file and the near end, of either kind."""
    import tty

    if request.param == "socket":
        with (
            socket.create_server(("127.0.0.1", 0)) as listener,
            socket.create_connection(listener.getsockname()) as near,
            listener.accept()[0] as far,
        ):
            far.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            file = SocketFile(near.fileno())
            yield far.fileno(), file
            file.forget()
            assert near.fileno() >= 0  # not ours to close
        return
    master, client = os.openpty()
    tty.setraw(client)
    os.set_blocking(client, False)
    yield master, TerminalFile(client)
    os.close(client)
    os.close(master)


def test_bytes_come_and_go(ends: tuple[int, TerminalFile]) -> None:
    master, file = ends
    assert file.waiting == 0
    assert file.read(5, 0.0, 0.0) == b""
    os.write(master, b"abcdef")
    assert file.read(4, 1.0, 1.0) == b"abcd"
    assert file.waiting == 2
    assert file.read(4, 0.0, 0.0) == b"ef"
    assert file.write(b"\x03xyz") == 4
    assert os.read(master, 10) == b"\x03xyz"


def test_a_quiet_line_ends_a_burst_long_before_the_timeout(
    ends: tuple[int, TerminalFile],
) -> None:
    master, file = ends
    os.write(master, b"abc")
    begin = time.monotonic()
    assert file.read(10, 30.0, 0.001) == b"abc"
    assert time.monotonic() - begin < 15.0


def test_a_timeout_gives_what_has_come(ends: tuple[int, TerminalFile]) -> None:
    master, file = ends
    assert file.read(3, 0.01, 0.01) == b""
    os.write(master, b"a")
    assert file.read(3, 0.01, 0.01) == b"a"


def test_some_is_all_that_is_there_once_the_least_is(
    ends: tuple[int, TerminalFile],
) -> None:
    master, file = ends
    assert file.read_some(2, 0.0) == b""
    os.write(master, b"abc")
    assert file.read_some(2, 30.0) == b"abc"
    os.write(master, b"d")
    # the least does not come: what has come is not lost
    assert file.read_some(2, 0.01) == b"d"
    rest = threading.Timer(0.02, os.write, (master, b"fgh"))
    os.write(master, b"e")
    rest.start()
    file.byte_s = 1e-3
    assert file.read_some(4, 30.0) == b"efgh"
    rest.join()


def test_some_tells_that_the_far_end_is_gone() -> None:
    near, far = socket.socketpair()
    with near:
        near.setblocking(False)
        far.close()
        with pytest.raises(OSError, match="gone"):
            TerminalFile(near.fileno()).read_some(1, 30.0)


def test_a_forgotten_file_is_not_read() -> None:
    file = TerminalFile(0)
    file.forget()
    with pytest.raises((OSError, ValueError)):
        file.read(1, 0.1, 0.1)
    with pytest.raises((OSError, ValueError)):
        file.read_some(1, 0.1)
