"""The emulated arm's port as a TCP port, for pyserial's ``socket://`` and others."""

import contextlib
import errno
import socket
from abc import ABC, abstractmethod

from system import UserError

LOOPBACK = "127.0.0.1"

_READ_BYTES = 4096


def parse_address(text: str) -> tuple[str, int]:
    """Read ``PORT`` or ``HOST:PORT``; without a host only this machine may connect."""
    host, colon, port = text.rpartition(":")
    if not port.isdecimal() or int(port) > 65535 or (colon and not host):
        raise UserError(f"an address is PORT or HOST:PORT, got {text!r}")
    return host or LOOPBACK, int(port)


class ServerPort(ABC):
    """The device's side of a port."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Return what a client opens."""

    @abstractmethod
    def plug(self) -> None:
        """Make the port appear."""

    @abstractmethod
    def pull(self) -> None:
        """Make the port disappear; its clients see the connection end."""

    @abstractmethod
    def sources(self) -> list[int]:
        """Return the descriptors that become readable when somebody wants something."""

    @abstractmethod
    def read(self) -> bytes:
        """Return what the client has written."""

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Hand ``data`` to the client; what nobody reads is lost, as on a cable."""

    def client_rate(self) -> int | None:
        """Return the client's rate, None where nobody can tell."""
        return None

    @abstractmethod
    def close(self) -> None:
        """Take the port away for good; harmless when repeated."""


class SocketPort(ServerPort):
    """A TCP port that serves one client at a time.

    Port 0 takes any that is free, and another one after every replugging. A client
    that leaves takes nothing with it: the arm's session stays open, as behind a cable.
    """

    def __init__(self, address: tuple[str, int]) -> None:
        self._address = address
        self._listener: socket.socket | None = None
        self._client: socket.socket | None = None
        self.plug()

    @property
    def name(self) -> str:
        """Return what pyserial's ``serial_for_url`` opens."""
        if self._listener is None:
            raise OSError(errno.EIO, "The port is not plugged in")
        host, port = self._listener.getsockname()[:2]
        return f"socket://{host}:{port}"

    def plug(self) -> None:
        if self._listener is None:
            try:
                self._listener = socket.create_server(self._address)
            except OSError as error:
                where = f"{self._address[0]}:{self._address[1]}"
                raise UserError(
                    f"The emulated arm cannot listen at {where} ({error.strerror}); "
                    "choose another port, or 0 for any."
                ) from error
            self._listener.setblocking(False)

    def pull(self) -> None:
        for end in (self._client, self._listener):
            if end is not None:
                end.close()
        self._client = self._listener = None

    def sources(self) -> list[int]:
        ends = (self._listener, self._client)
        return [end.fileno() for end in ends if end is not None]

    def read(self) -> bytes:
        """Return what the client has written; let in who knocks."""
        self._accept()
        if self._client is None:
            return b""
        try:
            data = self._client.recv(_READ_BYTES)
        except BlockingIOError:
            return b""
        except ConnectionError:
            data = b""
        if not data:
            self._client.close()
            self._client = None
        return data

    def write(self, data: bytes) -> None:
        if self._client is not None:
            # A client that does not read, or has just gone, gets no more.
            with contextlib.suppress(BlockingIOError, ConnectionError):
                self._client.send(data)

    def close(self) -> None:
        self.pull()

    def _accept(self) -> None:
        if self._listener is None:
            return
        with contextlib.suppress(BlockingIOError, ConnectionError):
            client, _ = self._listener.accept()
            if self._client is not None:
                client.close()
                return
            client.setblocking(False)
            # Sixteen bytes must not wait for company.
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client = client
