"""What carries messages between ranks.

A transport is reliable, keeps the order of messages between each ordered pair of ranks
over all kinds, and promises no other order. Nothing else is assumed.
"""

from collections.abc import Sequence
from typing import Protocol

from renderers.art.ranks.messages import Message


class TransportError(RuntimeError):
    """The ranks cannot reach each other, or one of them gave up."""


class RankRefusedError(TransportError):
    """A rank cannot take part in this frame; the next frame may succeed."""


class Transport(Protocol):
    """Promise what a rank needs. Messages to oneself come back like any other."""

    @property
    def rank(self) -> int:
        """Return this rank."""
        ...

    @property
    def ranks(self) -> int:
        """Return the number of ranks."""
        ...

    def distances(self, rank: int) -> Sequence[int]:
        """Return what separates a rank from each rank: 0 itself, 1 near, 2 far."""
        ...

    def send(self, message: Message) -> None:
        """Send without waiting; it may leave when messages are looked for next."""
        ...

    def flush(self) -> None:
        """Let what was sent leave now."""
        ...

    def poll(self) -> Message | None:
        """Take the next message that has arrived, if any."""
        ...

    def rest(self, waiting: bool) -> None:
        """Let others have the processor: there was nothing to do.

        waiting: another rank owes this one an answer; silence is then watched.
        """
        ...
