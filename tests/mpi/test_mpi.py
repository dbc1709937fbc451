"""What the transport between processes promises beyond messages' order."""

from pathlib import Path

from tests.mpi.launching import NEEDS_RANKS, run_two

pytestmark = NEEDS_RANKS

MESSAGES = 10

RANKS = f"""
import sys, time
from pathlib import Path
from renderers.art.ranks.messages import Message, MessageKind
from renderers.art.ranks.mpi import MpiTransport

transport = MpiTransport(folder=Path(sys.argv[1]))
sent = Path(sys.argv[1], "sent")
transport.meet()
if transport.rank == 0:
    for cell in range({MESSAGES}):
        transport.send(Message(MessageKind.REQUEST, 0, 1, 1, cell))
        transport.poll()
    sent.touch()
else:
    # No call of MPI before all have left: what fetches them is the look itself.
    deadline = time.monotonic() + 30
    while not sent.exists():
        assert time.monotonic() < deadline, "rank 0 did not send for 30 s"
        time.sleep(0.01)
    found = [transport.poll() for _ in range({MESSAGES} + 1)]
    print([None if m is None else m.cell for m in found], flush=True)
transport.close()
"""


def test_a_look_finds_what_has_arrived(tmp_path: Path) -> None:
    done = run_two(RANKS, tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == str([*range(MESSAGES), None])
