"""Messages between processes by MPI.

Every message is one send of bytes with one tag. Receiving with matched probes for any
tag keeps the order of each pair; a probe for each tag would not (ten sends with
alternating tags came out 1 3 5 7 9 0 2 4 6 8).
"""

import os
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from mpi4py import MPI

from renderers.art.messages import (
    HEADER_BYTES,
    LARGEST_PAYLOAD,
    Message,
    ProtocolError,
    sequence_of,
)
from renderers.art.transport import TransportError

_TAG = 1

YIELD_S = 1e-3
"""Time of yielding before sleeping. A bare spin costs 400 times on an oversubscribed
machine (4 ranks on 2 cores: 8 ms a request against 20 us)."""

SLEEP_S = 50e-6

STALL_S = 60.0
"""Silence after which a rank that waits for a cell gives up. A rank may compile its
kernels for half a minute before it first answers."""


@contextmanager
def _told() -> Iterator[None]:
    """Turn MPI's complaint, of a rank that died for instance, into our own error."""
    try:
        yield
    except MPI.Exception as error:
        reason = str(error).splitlines()[0]
        raise TransportError(f"MPI broke down: {reason}.") from error


class MpiTransport:
    """Carry messages over a duplicate of a communicator; one thread only."""

    def __init__(self, communicator: MPI.Intracomm | None = None) -> None:
        self._comm = (communicator or MPI.COMM_WORLD).Dup()
        self.rank = self._comm.Get_rank()
        self.ranks = self._comm.Get_size()
        self._near = self._ranks_of_this_node()
        self._sent: Counter[int] = Counter()
        self._received: Counter[int] = Counter()
        self._to_self: deque[Message] = deque()
        self._sending: list[tuple[MPI.Request, bytes]] = []
        self._idle_since: float | None = None
        self._waiting_since: float | None = None

    def distances(self, rank: int) -> Sequence[int]:
        """Get 0 for a rank itself, 1 on the same machine, 2 elsewhere."""
        here = self._near[rank]
        row = [1 if node == here else 2 for node in self._near]
        row[rank] = 0
        return row

    def send(self, message: Message) -> None:
        """Send without waiting; the bytes are kept until MPI has taken them."""
        if message.target == self.rank:
            self._to_self.append(message)
            return
        self._waiting_since = None
        record = message.encode(self._sent[message.target])
        self._sent[message.target] += 1
        with _told():
            request = self._comm.Isend([record, MPI.BYTE], message.target, _TAG)
        self._sending.append((request, record))

    def poll(self) -> Message | None:
        """Take the next message, those to oneself first."""
        if self._to_self:
            return self._to_self.popleft()
        with _told():
            if self._sending:
                self._sending = [s for s in self._sending if not s[0].Test()]
            status = MPI.Status()
            matched = self._comm.Improbe(MPI.ANY_SOURCE, MPI.ANY_TAG, status)
            if matched is None:
                return None
            self._idle_since = self._waiting_since = None
            size = status.Get_count(MPI.BYTE)
            if size > HEADER_BYTES + LARGEST_PAYLOAD:
                raise TransportError(
                    f"Rank {status.Get_source()} sent a message of {size} bytes."
                )
            record = np.empty(size, np.uint8)
            matched.Recv([record, MPI.BYTE])
        return self._in_order(status.Get_source(), record.tobytes())

    def rest(self, waiting: bool) -> None:
        """Yield the processor, then sleep; raise TransportError after long silence."""
        now = time.monotonic()
        if self._idle_since is None:
            self._idle_since = now
        if not waiting:
            self._waiting_since = None
        elif self._waiting_since is None:
            self._waiting_since = now
        elif now - self._waiting_since > STALL_S:
            raise TransportError(
                f"Rank {self.rank} has waited {STALL_S:.0f} s for a cell; another rank "
                "has stopped answering."
            )
        if now - self._idle_since < YIELD_S:
            os.sched_yield()
        else:
            time.sleep(SLEEP_S)

    def close(self) -> None:
        """Let every message leave, then free the communicator; all ranks together."""
        while self._sending:
            self._sending = [s for s in self._sending if not s[0].Test()]
            os.sched_yield()
        self._comm.Free()

    def abort(self) -> None:
        """End all ranks at once."""
        self._comm.Abort(1)

    def _in_order(self, source: int, record: bytes) -> Message:
        # Cells would be lost or kept for ever if a pair's messages changed places.
        message = Message.decode(record)
        due = self._received[source] & 0xFFFFFFFF
        if sequence_of(record) != due or message.source != source:
            raise ProtocolError(
                f"message {sequence_of(record)} of rank {message.source} came from "
                f"rank {source} where its number {due} was due"
            )
        self._received[source] += 1
        return message

    def _ranks_of_this_node(self) -> list[int]:
        """Name each rank's machine by the lowest rank on it; all ranks together."""
        local = self._comm.Split_type(MPI.COMM_TYPE_SHARED)
        lowest = np.array([self.rank], np.int64)
        local.Bcast(lowest)
        local.Free()
        names = np.empty(self.ranks, np.int64)
        self._comm.Allgather(lowest, names)
        return [int(name) for name in names]
