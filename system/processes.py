"""Child processes that end as a whole, and who else runs: the same words everywhere."""

import os
import signal
import subprocess
import sys
from contextlib import suppress
from typing import Any


def group_options() -> dict[str, Any]:
    """Return what to give to `subprocess.Popen` for a child with a group of its own.

    Ctrl-C does not reach such a child; `end_group` ends it with its own children.
    """
    if sys.platform == "win32":
        return {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
    return {"start_new_session": True}


def end_group(child: "subprocess.Popen[bytes]", patience_s: float) -> None:
    """End a child of `group_options` and its own children, kindly first; wait for it.

    patience_s: given between asking and killing.
    """
    if sys.platform == "win32":
        import psutil

        try:
            family = psutil.Process(child.pid).children(recursive=True)
        except psutil.NoSuchProcess:
            family = []
        child.terminate()
        for member in family:
            try:
                member.kill()
            except psutil.NoSuchProcess:
                continue
        child.wait()
        return
    for number in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(child.pid, number)
        except ProcessLookupError:
            break
        try:
            child.wait(patience_s)
        except subprocess.TimeoutExpired:
            continue
    child.wait()


def lower_priority(child: "subprocess.Popen[bytes]", niceness: int) -> None:
    """Let everybody else have the processor first.

    child: of `group_options`. niceness: 1 to 19, the more the later; any of them means
    the lowest class on Windows.
    """
    if sys.platform == "win32":
        import psutil

        psutil.Process(child.pid).nice(psutil.IDLE_PRIORITY_CLASS)
        return
    os.setpriority(os.PRIO_PGRP, child.pid, niceness)


def be_punctual(priority: int) -> None:
    """Let this thread go before all that is not real-time, where that is granted.

    Not everybody may ask for that, and elsewhere than on Linux nobody can.
    """
    if sys.platform == "linux":
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))


def is_alive(process: int) -> bool:
    """Return whether a process of this number runs, anybody's."""
    if sys.platform == "win32":
        import psutil

        # os.kill would end it there
        return bool(psutil.pid_exists(process))
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def user_number() -> int | None:
    """Return the number of the user this process acts for; None without numbers."""
    if sys.platform == "win32":
        return None
    return os.geteuid()
