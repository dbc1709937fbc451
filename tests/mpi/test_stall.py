"""A rank that waits in vain says so, and all ranks leave what they heard last."""

from pathlib import Path

from tests.mpi.launching import NEEDS_RANKS, run_two

pytestmark = NEEDS_RANKS

RANKS = """
import sys, time
from pathlib import Path
from renderers.art.ranks.messages import Message, MessageKind
from renderers.art.ranks.mpi import MpiTransport
from renderers.art.ranks.transport import TransportError

transport = MpiTransport(folder=Path(sys.argv[1]), stall_s=0.3)
transport.meet()
asks = transport.rank == 0
if asks:
    transport.send(Message(MessageKind.REQUEST, 0, 1, 5, 77))
deadline = time.monotonic() + 30
try:
    while time.monotonic() < deadline:
        # Rank 1 hears and never answers.
        if transport.poll() is None:
            transport.rest(asks)
except TransportError as error:
    print(error, flush=True)
    if asks:
        transport.abort()
    time.sleep(10)
"""


def test_a_rank_that_is_not_answered_ends_all_and_leaves_its_record(
    tmp_path: Path,
) -> None:
    done = run_two(RANKS, tmp_path)
    assert done.returncode != 0
    reason = "Rank 0 has waited 0 s for a cell"
    assert done.stdout.count(reason) == 2
    for rank, way in ((0, "to"), (1, "from")):
        first, *heard = (tmp_path / f"flight-rank-{rank}.txt").read_text().splitlines()
        assert first.startswith(f"rank {rank}: {reason}")
        words = heard[0].split()
        assert words[2:5] == [way, str(1 - rank), "REQUEST"]
        assert words[5:9] == ["cell", "77", "frame", "5"]
