import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from renderers.scene import Camera, Scene
from renderers.snapshots.__main__ import main
from renderers.snapshots.client import SnapshotClient


@contextmanager
def worker(spool: Path, *options: str) -> Iterator["subprocess.Popen[str]"]:
    command = [
        sys.executable,
        "-m",
        "renderers.snapshots",
        "--spool",
        str(spool),
        *options,
    ]
    child = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        yield child
    finally:
        if child.poll() is None:
            child.kill()
        child.communicate()


def test_a_spool_that_cannot_be_used_is_one_sentence_and_status_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "file"
    file.touch()
    handlers = [signal.getsignal(s) for s in (signal.SIGTERM, signal.SIGINT)]
    try:
        assert main(["--spool", str(file), "--once"]) == 1
    finally:
        signal.signal(signal.SIGTERM, handlers[0])
        signal.signal(signal.SIGINT, handlers[1])
    out, err = capsys.readouterr()
    assert not out
    assert err == f"Spool {file} cannot be used: File exists.\n"


def test_a_worker_serves_then_ends_on_a_signal_without_a_word(
    tmp_path: Path, scene: Scene, outside: Camera
) -> None:
    client = SnapshotClient(tmp_path / "spool")
    job = client.submit(client.request_classic(scene, outside))
    with worker(client.spool.folder) as child:
        assert client.wait(job, timeout_s=120).picture.exists()
        child.send_signal(signal.SIGTERM)
        said, _ = child.communicate(timeout=20)
        assert (said, child.returncode) == ("", 0)


def test_a_worker_ends_with_its_parent(tmp_path: Path) -> None:
    parent = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    spool = tmp_path / "spool"
    with worker(spool, "--parent", str(parent.pid)) as child:
        while not (spool / "data").exists():
            assert child.poll() is None
            time.sleep(0.05)
        os.kill(parent.pid, signal.SIGKILL)
        parent.wait()
        said, _ = child.communicate(timeout=20)
        assert (said, child.returncode) == ("", 0)
    assert parent.stdin is not None
    parent.stdin.close()
