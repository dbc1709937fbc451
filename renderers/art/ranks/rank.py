"""One rank's part in frame after frame: its node, driven over a transport.

Rank 0 also gathers the picture. A frame is complete when every rank has said DONE, for
a rank that is done has no unfinished ray and waits for no answer: then no message of
the frame is on its way except the control of the frame itself. END lets the ranks go.

A frame is given up by CANCEL, after which it completes without rays; the cells stay in
order. A frame that broke, because a rank could not take part, ends at once; what its
nodes know of cells is then worth nothing, and `is_broken` tells that.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable
from typing import Any, Protocol

import msgspec

from renderers.art.job_steps import Step, reached
from renderers.art.ranks.messages import CELL_KINDS, Message, MessageKind, ProtocolError
from renderers.art.ranks.transport import RankRefusedError, Transport
from renderers.art.regions import Gather

PACKETS_A_STEP = 1
"""Packets run between two polls: about 1,000 rays, some .5 ms; a poll costs .5 us."""


class FrameNode(Protocol):
    """Promise what a rank drives."""

    @property
    def is_active(self) -> bool:
        """Return whether `advance` could do anything."""
        ...

    @property
    def is_finished(self) -> bool:
        """Return whether this rank's rays are finished and no answer is due to it."""
        ...

    @property
    def is_waiting(self) -> bool:
        """Return whether another rank owes this one an answer."""
        ...

    def tally(self) -> dict[str, int]:
        """Return what this node has done so far."""
        ...

    def begin(self, frame: int, packets: Iterable[Any]) -> None:
        """Start a frame with packets of whatever the node's work knows."""
        ...

    def add(self, packets: Iterable[Any]) -> None:
        """Take more packets of this frame."""
        ...

    def advance(self, budget: int) -> list[Message]:
        """Move up to `budget` packets; return what is to be sent."""
        ...

    def handle(self, message: Message) -> list[Message]:
        """Take a message; return what is to be sent because of it."""
        ...

    def cancel(self) -> None:
        """Drop what is left of the frame."""
        ...


class Rank:
    """Drive nodes over a transport.

    Messages of a frame that this rank has not begun are kept until it does: no order
    is promised between ranks, so another rank may ask for a cell before rank 0's word
    to begin has come. Those of a frame that ended are dropped.
    """

    def __init__(
        self,
        transport: Transport,
        threads: int = 1,
        packets: int = PACKETS_A_STEP,
    ) -> None:
        """Join. threads: that the nodes' work is shared out to. packets: run between
        two polls.
        """
        self.transport = transport
        self._threads = threads
        self._packets = packets
        self.frame = 0
        self.orders: deque[Message] = deque()
        self._node: FrameNode | None = None
        self._gather: Gather | None = None
        self._turns: Callable[[], list[Any] | None] | None = None
        self._early: list[Message] = []
        self._before: dict[str, int] = {}
        self.cost: Counter[str] = Counter()
        """What the frame has cost all ranks that are done (rank 0 only)."""
        self._done_ranks: set[int] = set()
        self._said_done = False
        self.is_broken = False
        """The frame that ended last left cells in disorder: make new nodes."""

    @property
    def is_drawing(self) -> bool:
        """Return whether a frame is going on here."""
        return self._node is not None

    def begin(
        self,
        frame: int,
        node: FrameNode,
        packets: Iterable[Any],
        gather: Gather | None = None,
        turns: Callable[[], list[Any] | None] | None = None,
    ) -> None:
        """Start a frame; rank 0, and no other, brings the picture to gather.

        turns: called for more packets whenever there is nothing to do, until it
        returns None.
        """
        if (gather is not None) != (self.transport.rank == 0):
            raise ValueError("rank 0, and only rank 0, gathers the picture")
        node.begin(frame, packets)
        self.frame, self._node, self._gather = frame, node, gather
        self._turns = turns
        self.is_broken = False
        self._before = node.tally()
        self.cost.clear()
        self._done_ranks.clear()
        self._said_done = False
        reached(Step.FRAME_BEGUN)
        early, self._early = self._early, []
        for message in early:
            self._take(message)

    def step(self) -> bool:
        """Take what has arrived, then move some rays; tell whether there was work.

        Raise RankRefusedError when another rank cannot take part.
        """
        worked = False
        while (message := self.transport.poll()) is not None:
            worked = True
            self._take(message)
        node = self._node
        if node is None:
            return worked
        if node.is_active:
            worked = True
            self._send_all(node.advance(self._packets))
            reached(Step.RAYS_MOVED)
        elif self._turns is not None:
            worked = True
            packets = self._turns()
            if packets is None:
                self._turns = None
            else:
                node.add(packets)
            reached(Step.RAYS_MOVED)
        if self._turns is None and node.is_finished and not self._said_done:
            self._said_done = True
            after = node.tally()
            cost = {name: after[name] - self._before[name] for name in after}
            cost["threads"] = self._threads
            self._say(MessageKind.DONE, 0, msgspec.json.encode(cost))
            reached(Step.RANK_DONE)
        return worked

    def rest(self) -> None:
        """Return the processor away after a step without work."""
        self.transport.rest(self._node is not None and self._node.is_waiting)

    def order(
        self, kind: MessageKind, frame: int, payload: bytes = b"", *, aux: int = 0
    ) -> None:
        """Send every other rank a control message; rank 0 only."""
        for target in range(1, self.transport.ranks):
            source = self.transport.rank
            message = Message(kind, source, target, frame, 0, payload, aux=aux)
            self.transport.send(message)
        # nobody shall wait for what this rank does before it looks for messages
        self.transport.flush()

    def cancel(self) -> None:
        """Return the frame's rays up everywhere; it still has to complete."""
        self.order(MessageKind.CANCEL, self.frame)
        self._cancel()

    def end(self) -> None:
        """Leave the frame and take the others along; it breaks when not complete."""
        self.is_broken = not self.is_complete
        self.order(MessageKind.END, self.frame, aux=int(self.is_broken))
        self._leave()

    def fail(self, frame: int, reason: str) -> None:
        """Tell rank 0 that this rank cannot take part in a frame."""
        self.frame = frame
        self._say(MessageKind.FAILED, 0, reason.encode())

    def _cancel(self) -> None:
        self._turns = None
        if self._node is not None:
            self._node.cancel()

    def _leave(self) -> None:
        self._node = self._turns = None
        self._gather = None

    def _say(self, kind: MessageKind, target: int, payload: bytes = b"") -> None:
        source = self.transport.rank
        self.transport.send(Message(kind, source, target, self.frame, 0, payload))

    def _send_all(self, messages: Iterable[Message]) -> None:
        for message in messages:
            self.transport.send(message)

    def _take(self, message: Message) -> None:
        kind = message.kind
        if kind in (MessageKind.BEGIN, MessageKind.STOP):
            self.orders.append(message)
        elif message.frame > self.frame:
            self._early.append(message)
        elif kind is MessageKind.END and message.frame == self.frame:
            self.is_broken = bool(message.aux)
            self._leave()
            reached(Step.FRAME_LEFT)
        elif message.frame < self.frame or self._node is None:
            return
        elif kind is MessageKind.CANCEL:
            self._cancel()
        elif kind in CELL_KINDS:
            self._send_all(self._node.handle(message))
        elif self._gather is None:
            raise ProtocolError(f"rank {self.transport.rank} was sent {kind.name}")
        elif kind is MessageKind.REGION:
            self._gather.add_payload(message.payload)
        elif kind is MessageKind.FAILED:
            reason = message.payload.decode(errors="replace")
            raise RankRefusedError(f"Rank {message.source} cannot take part: {reason}")
        else:
            self.cost.update(msgspec.json.decode(message.payload, type=dict[str, int]))
            self._done_ranks.add(message.source)

    @property
    def is_complete(self) -> bool:
        """Return whether every rank is done (rank 0 only)."""
        return len(self._done_ranks) == self.transport.ranks
