"""Hides from this program what only POSIX systems have; other code keeps it.

Read by `sitecustomize` in every Python process of a test. Our modules, and only these,
find no module of `MODULES` and no name of `NAMES`, and can wait for nothing but
sockets, as on Windows. Other people's code has its own ways there.
"""

import builtins
import os
import stat
import types
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


MODULES = _words("curses fcntl grp posix pty pwd readline resource syslog termios tty")

NAMES = {
    "os": _words(
        "O_DIRECTORY O_NOCTTY O_NOFOLLOW O_NONBLOCK chown fork forkpty getegid geteuid "
        "getgid getgroups getloadavg getpgid getpriority getuid killpg mkfifo openpty "
        "sched_getaffinity sched_setaffinity sched_setscheduler sched_yield "
        "set_blocking setpgid setpriority setsid statvfs sysconf ttyname uname wait4 "
        "waitid"
    ),
    "signal": _words(
        "SIGALRM SIGCHLD SIGHUP SIGKILL SIGPIPE SIGQUIT SIGUSR1 SIGUSR2 alarm pause "
        "pthread_kill setitimer sigwait"
    ),
    "select": _words("epoll poll kqueue"),
    "socket": _words("AF_UNIX SCM_RIGHTS"),
}

MAY_USE_NAMES = frozenset(
    # the words for it on every system: they ask which one this is
    ("system.processes", "system.resources")
)

OURS = frozenset(
    path.name for path in ROOT.iterdir() if (path / "__init__.py").is_file()
) - {"tests"}


class _Without(types.ModuleType):
    """A module with some of its names hidden."""

    def __init__(self, real: types.ModuleType) -> None:
        super().__init__(real.__name__)
        self._real = real

    def __getattr__(self, name: str) -> Any:
        if name in NAMES[self._real.__name__]:
            raise AttributeError(f"{self._real.__name__} has no {name} here")
        if name == "select" and self._real.__name__ == "select":
            return _select
        return getattr(self._real, name)


def _select(read: Any, write: Any, odd: Any, timeout: Any = None) -> Any:
    import select

    for one in (*read, *write, *odd):
        number = one if isinstance(one, int) else one.fileno()
        if not stat.S_ISSOCK(os.fstat(number).st_mode):
            raise OSError(10038, "An operation was attempted on what is not a socket")
    return select.select(read, write, odd, timeout)


def hide() -> None:
    """Hide it from what our modules import from now on."""
    real = builtins.__import__
    hidden = {name: _Without(real(name)) for name in NAMES}

    def imported(
        name: str,
        globals: Any = None,
        locals: Any = None,
        fromlist: Any = (),
        level: int = 0,
    ) -> Any:
        about = globals or {}
        spec = about.get("__spec__")
        who = getattr(spec, "name", None) or about.get("__name__", "")
        if who.partition(".")[0] not in OURS:
            return real(name, globals, locals, fromlist, level)
        top = name.partition(".")[0]
        if top in MODULES:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        module = real(name, globals, locals, fromlist, level)
        if who in MAY_USE_NAMES or (fromlist and name != top):
            return module
        return hidden.get(top, module)

    builtins.__import__ = imported
