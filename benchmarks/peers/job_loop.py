"""How a peer in a child process gets its jobs and gives its answers."""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.peers.peer_process import Answer

Job = dict[str, Any]


def serve(work: Callable[[Job, Path], Answer]) -> None:
    """Answer jobs from standard input until it closes.

    The first argument of the process is the folder to leave pictures in. What a
    library prints goes to standard error: answers stay alone on standard output.
    """
    folder = Path(sys.argv[1])
    with os.fdopen(os.dup(1), "wb") as answers:
        os.dup2(2, 1)
        for line in sys.stdin.buffer:
            answers.write(msgspec.json.encode(work(msgspec.json.decode(line), folder)))
            answers.write(b"\n")
            answers.flush()
