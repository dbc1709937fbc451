"""Write a debrief in a process of its own: drawing its pictures would halt a window."""

import json
import subprocess
import sys
from pathlib import Path

from paravol.patient import Progress
from system import UserError


def write_beside(record: Path, out: Path, threads: int, progress: Progress) -> None:
    """Write a session's debrief and report how far it is; UserError says why not."""
    command = [sys.executable, "-m", __name__, str(record), str(out), str(threads)]
    told = "it ended without a word"
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as child:
        assert child.stdout is not None
        for line in child.stdout:
            if line.startswith("["):
                stage, share = json.loads(line)
                progress(stage, share)
            elif line.strip():
                told = line.strip()
    if child.returncode:
        raise UserError(told)


def main(words: list[str]) -> int:
    """Write it; a line of standard output for each step, a sentence for an error."""
    from paravol.environment import prepare_environment

    prepare_environment()
    from app.errors import sentence
    from paravol.debrief import DebriefOrder, write_debrief

    record, out, threads = words
    last = ""

    def progress(stage: str, share: float) -> None:
        nonlocal last
        line = json.dumps([stage, round(share, 2)])
        if line != last:
            last = line
            print(line, flush=True)

    order = DebriefOrder(Path(record), Path(out), threads=int(threads))
    try:
        write_debrief(order, progress, say=lambda _: None)
    except Exception as error:
        told = sentence(error)
        if told is None:
            raise
        print(told)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
