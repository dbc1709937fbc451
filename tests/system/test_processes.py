"""Children end as a whole, and one knows who lives."""

import os
import subprocess
import sys
import time

from system import end_group, group_options, is_alive, user_number

FAMILY = """
import subprocess, sys, time
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
print(child.pid, flush=True)
time.sleep(60)
"""

STUBBORN = """
import signal, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
print("deaf", flush=True)
time.sleep(60)
"""


def test_a_child_ends_with_its_own_children() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", FAMILY], stdout=subprocess.PIPE, **group_options()
    ) as child:
        assert child.stdout is not None
        grandchild = int(child.stdout.readline())
        assert is_alive(child.pid)
        assert is_alive(grandchild)
        end_group(child, 5.0)
        assert child.returncode != 0
        until = time.monotonic() + 10.0
        while is_alive(grandchild):
            assert time.monotonic() < until
            time.sleep(0.01)


def test_a_child_that_does_not_listen_is_killed() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", STUBBORN], stdout=subprocess.PIPE, **group_options()
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == b"deaf\n"
        end_group(child, 0.1)
        assert child.poll() is not None
        end_group(child, 0.1)  # harmless when repeated


def test_one_knows_who_lives_and_whose_one_is() -> None:
    assert is_alive(os.getpid())
    with subprocess.Popen([sys.executable, "-c", ""]) as child:
        pass
    assert not is_alive(child.pid)
    assert user_number() == os.geteuid()
