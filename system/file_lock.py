"""Locks on files, which the system takes from a process that dies, however it dies.

`flock` on POSIX systems; on Windows a byte far behind the file's end, because what is
locked there cannot be read. The libraries for this lock a file of their own, which they
empty or leave behind; here the file may be one that holds something.
"""

import errno
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

FAR_BYTE = 1 << 30
"""The byte that is locked on Windows. No file that is locked here is as long."""

_PAUSE_S = 0.05


class NoLocksError(OSError):
    """This system, or this disk, knows no locks."""


def lock_file(file: int, *, waits: bool) -> None:
    """Lock an open file until it is closed.

    waits: for another who holds it. Raises BlockingIOError where another holds it and
    nobody waits, NoLocksError where there are no locks.
    """
    if sys.platform == "win32":
        import msvcrt

        os.lseek(file, FAR_BYTE, os.SEEK_SET)
        while True:
            try:
                msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
            except PermissionError:
                if not waits:
                    raise BlockingIOError(errno.EAGAIN, "Another holds it") from None
                time.sleep(_PAUSE_S)
            else:
                return
    try:
        import fcntl
    except ImportError as error:
        raise NoLocksError(errno.ENOLCK, "This system knows no locks") from error
    try:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
    except BlockingIOError:
        raise
    except OSError as error:
        raise NoLocksError(error.errno, error.strerror, error.filename) from error


@contextmanager
def locked(path: Path, *, creates: bool = False) -> Iterator[None]:
    """Hold a file's lock; wait for another who does.

    creates: the file, where it is missing, and leaves it. Where there are no locks,
    nobody waits: what is done under them is rare and short. Raises OSError where the
    file cannot be opened.
    """
    flags = os.O_RDWR | os.O_CREAT if creates else os.O_RDONLY
    handle = os.open(path, flags, 0o600)
    try:
        with suppress(NoLocksError):
            lock_file(handle, waits=True)
        yield
    finally:
        os.close(handle)
