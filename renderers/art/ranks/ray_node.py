"""One rank where rays travel: cells stay with their owners and rays go to them.

The ray dataflow that the 1995 paper sets itself apart from (its section 1.2): each rank
starts the rays of its part of the screen; where a ray needs a cell that another rank
owns, the ray is sent there as it is, and when it is finished it comes home. A ray's
state is exact and resumable, so the picture has the same bits as by any other way.
"""

from collections import deque
from collections.abc import Iterable
from typing import Generic, Protocol, TypeVar

from renderers.art.ranks.messages import Message, MessageKind, ProtocolError

P = TypeVar("P")
P_in = TypeVar("P_in", contravariant=True)
T = TypeVar("T")


class TravelWork(Protocol[P_in, T]):
    """Promise what a `RayNode` needs, whatever a packet is and however it travels."""

    def start(self, packet: P_in) -> T:
        """Take a packet of this rank's own before its first move."""
        ...

    def move(self, trip: T) -> bool:
        """Move rays through this rank's cells; False when only interrupted."""
        ...

    def send_off(self, trip: T) -> list[tuple[int, bytes]]:
        """Take out the rays that stopped, by the rank that owns what they need."""
        ...

    def send_home(self, trip: T) -> tuple[int, bytes] | None:
        """Take out a guest's finished rays, for the rank whose they are."""
        ...

    def welcome(self, payload: bytes) -> T:
        """Make a guest of rays that came."""
        ...

    def settle(self, trip: T) -> bytes | None:
        """Write a packet of this rank's own if all its rays are at home."""
        ...

    def take_home(self, payload: bytes) -> T:
        """Put finished rays back; give their packet."""
        ...

    def is_own(self, trip: T) -> bool:
        """Return whether a packet began here."""
        ...

    def forget(self) -> None:
        """Drop what is left of a frame that was given up."""
        ...

    def tally(self) -> dict[str, int]:
        """Return what moving rays has cost so far, by name."""
        ...


class RayNode(Generic[P, T]):
    """Trace this rank's packets, and any rays that come for its cells."""

    def __init__(self, work: TravelWork[P, T], rank: int) -> None:
        self.work = work
        self.rank = rank
        self.frame = 0
        self.generation = 0
        self._queue: deque[T] = deque()
        self._unfinished = 0
        self._is_cancelled = False
        self._sent = 0

    @property
    def is_finished(self) -> bool:
        """Return whether all rays of this rank are finished and at home.

        When this holds for every rank, no ray is on its way.
        """
        return self._unfinished == 0

    @property
    def is_active(self) -> bool:
        """Return whether `advance` could do anything."""
        return bool(self._queue)

    @property
    def is_waiting(self) -> bool:
        """Return whether rays of this rank are elsewhere, and nothing is to be done."""
        return self._unfinished > 0 and not self._queue

    @property
    def has_rays(self) -> bool:
        """Return whether any ray of this rank is unfinished."""
        return self._unfinished > 0

    def tally(self) -> dict[str, int]:
        """Return what this node has done so far."""
        return self.work.tally() | {"requests": self._sent}

    def begin(self, frame: int, packets: Iterable[P]) -> None:
        """Start a frame."""
        if frame <= self.frame:
            raise ProtocolError(f"frame {frame} cannot follow frame {self.frame}")
        self.frame = frame
        self._is_cancelled = False
        for packet in packets:
            self._unfinished += 1
            self._queue.append(self.work.start(packet))

    def cancel(self) -> None:
        """Drop what is left of the frame, rays on their way as they come."""
        self._queue.clear()
        self.work.forget()
        self._unfinished = 0
        self._is_cancelled = True

    def handle(self, message: Message) -> list[Message]:
        """Take rays, or take back this rank's own."""
        if message.kind not in (MessageKind.RAYS, MessageKind.RETURN):
            raise ProtocolError(f"{message.kind.name} came where rays travel")
        if self._is_cancelled:
            return []
        if message.kind is MessageKind.RAYS:
            self._queue.append(self.work.welcome(message.payload))
            return []
        return self._settle(self.work.take_home(message.payload))

    def advance(self, budget: int) -> list[Message]:
        """Move up to `budget` packets; send on what stopped and home what finished."""
        messages: list[Message] = []
        for _ in range(min(budget, len(self._queue))):
            trip = self._queue.popleft()
            if not self.work.move(trip):
                self._queue.appendleft(trip)
                continue
            for target, payload in self.work.send_off(trip):
                messages.append(self._say(MessageKind.RAYS, target, payload))
            if self.work.is_own(trip):
                messages += self._settle(trip)
            elif (home := self.work.send_home(trip)) is not None:
                messages.append(self._say(MessageKind.RETURN, *home))
        self._sent += sum(
            m.kind is not MessageKind.REGION and m.target != self.rank for m in messages
        )
        return messages

    def _settle(self, trip: T) -> list[Message]:
        payload = self.work.settle(trip)
        if payload is None:
            return []
        self._unfinished -= 1
        return [self._say(MessageKind.REGION, 0, payload)]

    def _say(self, kind: MessageKind, target: int, payload: bytes) -> Message:
        return Message(kind, self.rank, target, self.frame, payload=payload)
