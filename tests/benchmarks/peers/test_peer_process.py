"""A child that dies, fails or answers; none of it reaches us as more than a reason."""

import os
import textwrap
from pathlib import Path

import pytest

from benchmarks.peers.peer_process import PeerProcess
from benchmarks.plan import UnavailableError


@pytest.fixture
def child(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give a module `child_peer` that the child process can import."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return tmp_path / "child_peer.py"


def test_a_crash_is_a_reason_that_names_the_remedy(child: Path) -> None:
    child.write_text("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)\n")
    peer = PeerProcess("child_peer")
    for _ in range(2):
        with pytest.raises(UnavailableError, match=r"SIGSEGV.*libegl1"):
            peer.ask({})
    peer.close()


def test_a_failed_import_is_a_reason(child: Path) -> None:
    child.write_text("import no_such_library\n")
    peer = PeerProcess("child_peer")
    with pytest.raises(UnavailableError, match="No module named 'no_such_library'"):
        peer.ask({})
    peer.close()


def test_answers_and_refusals_come_through(child: Path) -> None:
    child.write_text(
        textwrap.dedent(
            """
            import json, sys
            for line in sys.stdin:
                job = json.loads(line)
                if job["good"]:
                    times = {"min_s": 1.0, "median_s": 2.0, "cpu_s": 0.5}
                    answer = {"timing": times | {"repeats": 3}}
                else:
                    answer = {"error": "cannot"}
                print(json.dumps(answer), flush=True)
            """
        )
    )
    peer = PeerProcess("child_peer")
    timing = peer.ask({"good": True}).timing
    assert (timing.min_s, timing.median_s, timing.cpu_s) == (1.0, 2.0, 0.5)
    with pytest.raises(UnavailableError, match="cannot"):
        peer.ask({"good": False})
    assert peer.ask({"good": True}).timing.repeats == 3
    assert peer._child is not None
    pid = peer._child.pid
    peer.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
