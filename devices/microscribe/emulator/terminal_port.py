"""The emulated arm's port as a pseudo-terminal."""

import errno
import os
import struct
import tempfile
from pathlib import Path

from devices.microscribe.emulator.socket_port import ServerPort

# struct termios2 of Linux: four flag words, the line discipline, 19 control
# characters, then the input and output rates as plain numbers.
_TERMIOS2 = struct.Struct("=4I20B2I")
_TCGETS2 = 0x802C542A

_READ_BYTES = 4096


def has_terminals() -> bool:
    """Return whether this system has pseudo-terminals."""
    try:
        import tty  # noqa: F401 (what makes them raw)
    except ImportError:
        return False
    return hasattr(os, "openpty")


class TerminalPort(ServerPort):
    """A pseudo-terminal that can be pulled and put in again under another name.

    ``link`` is a symbolic link that is kept pointing at the terminal and removed at
    the end; FileExistsError when something else is there already.
    """

    def __init__(self, link: Path | None = None) -> None:
        if link is not None and os.path.lexists(link) and not link.is_symlink():
            raise FileExistsError(
                errno.EEXIST, "There is already something that is no link", str(link)
            )
        self._link = link
        self._spare: tuple[int, int] | None = None
        self._ends: tuple[int, int] | None = None
        self.plug()

    @property
    def name(self) -> str:
        return os.ttyname(self._plugged()[1])

    def plug(self) -> None:
        if self._ends is None:
            self._ends, self._spare = self._spare or _raw_terminal(), None
            if self._link is not None:
                _point(self._link, self.name)

    def pull(self) -> None:
        if self._ends is not None:
            # Opened before the old one is closed, or it would get the same name.
            self._spare = _raw_terminal()
            self._close(self._ends)
            self._ends = None

    def sources(self) -> list[int]:
        return [] if self._ends is None else [self._ends[0]]

    def read(self) -> bytes:
        return os.read(self._plugged()[0], _READ_BYTES)

    def write(self, data: bytes) -> None:
        try:
            os.write(self._plugged()[0], data)
        except OSError as error:
            # Nobody reads and the terminal is full: a UART drops the bytes, too.
            if error.errno != errno.EAGAIN:
                raise

    def client_rate(self) -> int | None:
        return client_rate(self._plugged()[0])

    def close(self) -> None:
        for ends in (self._ends, self._spare):
            self._close(ends)
        if self._link is not None and self._link.is_symlink():
            self._link.unlink()
        self._ends = self._spare = self._link = None

    def _plugged(self) -> tuple[int, int]:
        if self._ends is None:
            raise OSError(errno.EIO, "The port is not plugged in")
        return self._ends

    def _close(self, ends: tuple[int, int] | None) -> None:
        for descriptor in ends or ():
            os.close(descriptor)


def client_rate(master: int) -> int | None:
    """Return the rate that the client set on its end, None where nobody can tell."""
    try:
        import fcntl

        raw = fcntl.ioctl(master, _TCGETS2, bytes(_TERMIOS2.size))
    except (ImportError, OSError):
        return None
    return int(_TERMIOS2.unpack(raw)[-1])


def _raw_terminal() -> tuple[int, int]:
    """Open a pair: our end and the client's.

    Our own descriptor of the client's end keeps the terminal alive between two
    clients. Raw before anybody opens it: 03 is a poll and not an interrupt.
    """
    import tty

    master, client = os.openpty()
    tty.setraw(client)
    os.set_blocking(master, False)
    return master, client


def _point(link: Path, target: str) -> None:
    """Make ``link`` point at ``target``, whole or not at all."""
    with tempfile.TemporaryDirectory(dir=link.parent) as folder:
        fresh = Path(folder, "link")
        fresh.symlink_to(target)
        fresh.replace(link)
