"""Reading and writing a terminal by its file, for POSIX systems, or a TCP socket.

pyserial opens terminals and sets them up. Setting its timeout, however, sets the whole
terminal anew, and its reading and writing think three times as long as the system
call takes; a pose passes here a hundred times a second and more.
"""

import os
import select
import socket
import time
from array import array

TERMINAL_ERRORS: tuple[type[Exception], ...] = (OSError,)
"""What goes wrong with a terminal; pyserial lets these pass through untranslated."""

try:
    import fcntl
    import termios
except ImportError:
    TERMINALS_ARE_FILES = False
else:
    TERMINALS_ARE_FILES = True
    TERMINAL_ERRORS = (OSError, termios.error)

# A shorter pause is not worth a wake-up of its own.
SHORT_PAUSE_S = 0.0003

# What a kernel holds for a terminal.
LARGEST_READ = 4096


class TerminalFile:
    """An open terminal whose reads do not block; raises OSError when it has gone."""

    def __init__(self, file: int) -> None:
        self.byte_s = 0.0
        """Seconds that one byte takes on the line."""
        self._file = file
        self._watched = (file,)
        self._count = array("i", (0,))

    @property
    def waiting(self) -> int:
        """Return how many bytes have arrived unread."""
        fcntl.ioctl(self._file, termios.FIONREAD, self._count)
        return self._count[0]

    def read(self, count: int, timeout_s: float, quiet_s: float) -> bytes:
        """Return up to ``count`` bytes.

        Fewer when the timeout ends first, or when after a byte the line has been
        quiet for ``quiet_s``.
        """
        if timeout_s <= 0.0:
            return self._read_now(count)
        until = time.monotonic() + timeout_s
        data = b""
        while len(data) < count:
            left = max(until - time.monotonic(), 0.0)
            if data:
                # The rest together, instead of a wake-up for every byte.
                pause = min((count - len(data)) * self.byte_s, left)
                left = min(left - pause, quiet_s)
                if pause < SHORT_PAUSE_S:
                    left += pause
                else:
                    time.sleep(pause)
            if not select.select(self._watched, (), (), left)[0]:
                break
            part = self._read_now(count - len(data))
            if not part:
                raise OSError(0, "the far end is gone")
            data += part
        return data

    def read_some(self, least: int, timeout_s: float) -> bytes:
        """Return all there is once ``least`` bytes are; fewer after the timeout.

        Whole packets take one wake-up and one read.
        """
        data = b""
        until = None
        left = max(timeout_s, 0.0)
        while select.select(self._watched, (), (), left)[0]:
            part = self._read_now(LARGEST_READ)
            if not part:
                raise OSError(0, "the far end is gone")
            data += part
            missing = least - len(data)
            if missing <= 0:
                break
            if until is None:
                until = time.monotonic() + left
            pause = min(missing * self.byte_s, left)
            if pause >= SHORT_PAUSE_S:
                time.sleep(pause)
            left = max(until - time.monotonic(), 0.0)
        return data

    def write(self, data: bytes) -> int:
        """Return how many of the bytes the terminal took at once."""
        try:
            return os.write(self._file, data)
        except BlockingIOError:
            return 0

    def forget(self) -> None:
        """Let go of the file; whoever opens one next may be given its number."""
        self._file = -1
        self._watched = (-1,)

    def _read_now(self, count: int) -> bytes:
        """Return what is there; terminals say "nothing" in both of these ways."""
        try:
            return os.read(self._file, count)
        except BlockingIOError:
            return b""


class SocketFile(TerminalFile):
    """A connected TCP socket that is read as a terminal is, on every system.

    pyserial's own reading of sockets waits for the whole timeout where fewer bytes come
    than were asked for, and leaves single bytes to wait for company.
    """

    def __init__(self, file: int) -> None:
        super().__init__(file)
        self._socket = socket.socket(fileno=file)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    @property
    def waiting(self) -> int:
        """Return how many bytes have arrived unread, `LARGEST_READ` at most."""
        try:
            return len(self._socket.recv(LARGEST_READ, socket.MSG_PEEK))
        except BlockingIOError:
            return 0

    def write(self, data: bytes) -> int:
        """Return how many of the bytes the system took at once."""
        try:
            return self._socket.send(data)
        except BlockingIOError:
            return 0

    def forget(self) -> None:
        """Let go of the socket, which is another's to close."""
        self._socket.detach()
        super().forget()

    def _read_now(self, count: int) -> bytes:
        try:
            return self._socket.recv(count)
        except BlockingIOError:
            return b""
