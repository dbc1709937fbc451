"""What a rank did, step by step, so that simulated nodes can be made to do the same."""

import time
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.art.ranks.messages import Message, MessageKind
from renderers.art.ranks.rank import FrameNode

BEGIN, ADVANCE, HANDLE, SAY = 0, 1, 2, 3
"""Events: a frame begins, packets move, a message is handled; SAY follows the event
that caused it."""

COLUMNS = ("event", "kind", "source", "target", "frame", "cell", "who", "aux", "size")


class Recording:
    """Be a node, and write down what it is told and says.

    latency_s: from each request to its cell. move_s: of each `advance`, processor time.
    """

    def __init__(self, node: FrameNode) -> None:
        self._node = node
        self._rows: list[tuple[int, ...]] = []
        self._asked: dict[int, float] = {}
        self.latency_s: list[float] = []
        self.move_s: list[float] = []

    @property
    def is_active(self) -> bool:
        """Ask the node."""
        return self._node.is_active

    @property
    def is_finished(self) -> bool:
        """Ask the node."""
        return self._node.is_finished

    @property
    def is_waiting(self) -> bool:
        """Ask the node."""
        return self._node.is_waiting

    def tally(self) -> dict[str, int]:
        """Ask the node."""
        return self._node.tally()

    def begin(self, frame: int, packets: Iterable[Any]) -> None:
        """Note the frame."""
        self._rows.append((BEGIN, 0, 0, 0, frame, 0, 0, 0, 0))
        self._node.begin(frame, packets)

    def cancel(self) -> None:
        """Refuse: a recording is of whole frames."""
        raise ValueError("a frame that is recorded cannot be given up")

    def advance(self, budget: int) -> list[Message]:
        """Note the move and what was said."""
        began = time.thread_time()
        said = self._node.advance(budget)
        self.move_s.append(time.thread_time() - began)
        self._rows.append((ADVANCE, budget, 0, 0, 0, 0, 0, 0, 0))
        self._say(said)
        return said

    def handle(self, message: Message) -> list[Message]:
        """Note the message and the answers."""
        self._rows.append((HANDLE, *fields(message)))
        if message.kind is MessageKind.DATA and message.cell in self._asked:
            asked = self._asked.pop(message.cell)
            self.latency_s.append(time.perf_counter() - asked)
        said = self._node.handle(message)
        self._say(said)
        return said

    def events(self) -> NDArray[np.int64]:
        """Return all events, one row each, by `COLUMNS`."""
        return np.array(self._rows, np.int64).reshape(-1, len(COLUMNS))

    def _say(self, said: list[Message]) -> None:
        for message in said:
            if message.kind is MessageKind.REQUEST:
                self._asked[message.cell] = time.perf_counter()
            self._rows.append((SAY, *fields(message)))


def fields(message: Message) -> tuple[int, ...]:
    """Return what identifies a message, with the size of a payload of rays."""
    travels = message.kind in (MessageKind.RAYS, MessageKind.RETURN)
    return (
        int(message.kind),
        message.source,
        message.target,
        message.frame,
        message.cell,
        message.who,
        message.aux,
        len(message.payload) if travels else 0,
    )
