"""A transport that stays inside the process."""

from collections import deque
from collections.abc import Sequence

import numpy as np

from renderers.art.ranks.messages import Message
from renderers.art.ranks.transport import TransportError


class LoopBack:
    """Join ranks within one process; deliver in a random order drawn from a seed.

    Each pair keeps its order. `delay` is the chance that a message which has arrived
    is not seen yet. Messages travel as bytes, as they would between processes.
    """

    def __init__(self, ranks: int, seed: int = 0, delay: float = 0.3) -> None:
        if ranks < 1 or not 0 <= delay < 1:
            raise ValueError(f"no loop-back has {ranks} ranks and delay {delay}")
        self.ranks = ranks
        self._random = np.random.default_rng(seed)
        self._delay = delay
        self._queues: dict[tuple[int, int], deque[bytes]] = {}

    def end(self, rank: int) -> "LoopBackEnd":
        """Return the transport of one rank."""
        return LoopBackEnd(self, rank)

    @property
    def in_flight(self) -> int:
        """Count the messages sent and not taken."""
        return sum(len(queue) for queue in self._queues.values())

    def flying(self) -> list[Message]:
        """Read the messages sent and not taken."""
        return [Message.decode(r) for queue in self._queues.values() for r in queue]

    def put(self, message: Message) -> None:
        """Queue a message."""
        if not 0 <= message.target < self.ranks:
            raise TransportError(f"there is no rank {message.target}")
        pair = message.source, message.target
        self._queues.setdefault(pair, deque()).append(message.encode())

    def take(self, rank: int) -> Message | None:
        """Take a message for a rank from a source drawn at random."""
        pairs = [p for p, q in self._queues.items() if p[1] == rank and q]
        if not pairs or self._random.random() < self._delay:
            return None
        pair = pairs[int(self._random.integers(len(pairs)))]
        return Message.decode(self._queues[pair].popleft())


class LoopBackEnd:
    """Be the transport of one rank of a `LoopBack`."""

    def __init__(self, joint: LoopBack, rank: int) -> None:
        self.rank = rank
        self.ranks = joint.ranks
        self._joint = joint

    def distances(self, rank: int) -> Sequence[int]:
        """Return all others the same distance."""
        return [int(other != rank) for other in range(self.ranks)]

    def send(self, message: Message) -> None:
        """Queue a message."""
        self._joint.put(message)

    def poll(self) -> Message | None:
        """Take the next message, unless it is delayed."""
        return self._joint.take(self.rank)

    def flush(self) -> None:
        """Do nothing: all has left."""

    def rest(self, waiting: bool) -> None:
        """Do nothing: the other ranks run in this thread."""
