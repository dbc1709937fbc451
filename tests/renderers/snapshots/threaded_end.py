"""A loop-back whose ranks run in threads of their own."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from renderers.art.ranks.messages import Message
from renderers.art.ranks.policy import CellPolicy
from renderers.art.ranks.rank import Rank
from renderers.snapshots.data_store import DataStore
from renderers.snapshots.team import RankTeam, follow
from tests.loop_back import LoopBack, LoopBackEnd

PATIENCE_S = 20.0


class ThreadedEnd(LoopBackEnd):
    """Let ranks of one loop-back run in threads of their own."""

    lock = threading.Lock()

    def send(self, message: Message) -> None:
        with self.lock:
            super().send(message)

    def poll(self) -> Message | None:
        with self.lock:
            return super().poll()

    def flush(self) -> None:
        """Do nothing: all has left."""

    def rest(self, waiting: bool) -> None:
        threading.Event().wait(1e-4)


@contextmanager
def threaded_team(data: DataStore, policy: CellPolicy) -> Iterator[RankTeam]:
    """Give a team of three ranks, which is dismissed before the end."""
    joint = LoopBack(3, delay=0)
    ranks = [Rank(ThreadedEnd(joint, rank)) for rank in range(3)]
    others = [
        threading.Thread(target=follow, args=(rank, data, policy)) for rank in ranks[1:]
    ]
    for other in others:
        other.start()
    yield RankTeam(ranks[0], policy)
    for other in others:
        other.join(PATIENCE_S)
        assert not other.is_alive(), f"a rank was not dismissed within {PATIENCE_S} s"
