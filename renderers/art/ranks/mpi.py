"""Messages between processes by MPI.

Every message is one send of bytes with one tag. Receiving with matched probes for any
tag keeps the order of each pair; a probe for each tag would not (ten sends with
alternating tags came out 1 3 5 7 9 0 2 4 6 8). What a rank has to say to another
between two looks for messages goes as one send: a packet's requests, a batch's answers.
"""

import os
import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import gettempdir

import numpy as np
from mpi4py import MPI

from renderers.art.ranks.message_log import FlightRecorder
from renderers.art.ranks.messages import (
    HEADER_BYTES,
    LARGEST_PAYLOAD,
    Message,
    MessageKind,
    ProtocolError,
    sequence_of,
    split_records,
)
from renderers.art.ranks.transport import TransportError
from system import usable_processors, use_processors

_TAG = 1

YIELD_S = 1e-4
_yield = getattr(os, "sched_yield", partial(time.sleep, 0.0))
"""Time of yielding before sleeping. A bare spin costs 400 times on an oversubscribed
machine (4 ranks on 2 cores: 8 ms a request against 20 us)."""

SLEEP_S = 50e-6

IDLE_SHARE, LONGEST_SLEEP_S = 0.05, 1e-3

IDLE_S = 0.1
"""Between two looks of a rank that has nothing to do for good."""

_MOST_PROCESSORS = 1 << 13
"""Of one machine, by Linux's own limit."""

STALL_S = 60.0
"""Time without an answer after which a rank that waits for one gives up. A rank may
compile its kernels for half a minute before it first answers."""

FAREWELL_S = 1.0
"""Time a rank that gives up leaves the others to write down what they know."""

_PROBES = 2
"""Probes before nothing is said to be there. MPICH's says no, and only then fetches
what has arrived: with one probe every second look found nothing, and a rank moved its
rays for each cell by itself (4 ranks on 2 cores: 1,300 moves instead of 400)."""

LONGEST_TEXT = 256
"""Bytes of what rank 0 says to all at once."""

LARGEST_BUNDLE = 1 << 18
"""Bytes of messages sent as one, unless a single one is longer."""

_ANSWERS = frozenset(
    (
        MessageKind.DATA,
        MessageKind.KEEP,
        MessageKind.INVALIDATE,
    )
)


@contextmanager
def _told() -> Iterator[None]:
    """Turn MPI's complaint, of a rank that died for instance, into our own error."""
    try:
        yield
    except MPI.Exception as error:
        reason = str(error).splitlines()[0]
        raise TransportError(f"MPI broke down: {reason}.") from error


class MpiTransport:
    """Carry messages between ranks that MPI started; one thread only."""

    def __init__(
        self,
        *,
        folder: Path | None = None,
        stall_s: float = STALL_S,
        one_a_machine: bool = False,
    ) -> None:
        """Join; all ranks together.

        folder: where a flight recorder is written when something is wrong; None for the
        folder of temporary files. stall_s: as `STALL_S`. one_a_machine: where there are
        several machines, the first rank of each works for the others there, too, with
        `processors` threads; those only wait, in `close`.
        """
        self._comm: MPI.Comm = MPI.COMM_WORLD.Dup()
        self.is_idle = False
        """Whether another rank of this machine does this one's work."""
        self.processors = 1
        """That this rank may have a thread on each of."""
        self._near = self._ranks_of_this_node()
        self.launched = len(self._near)
        """Ranks that were started, idle ones included."""
        if one_a_machine and not self.is_one_machine:
            self._join_machine()
        self.rank = self._comm.Get_rank()
        self.ranks = self._comm.Get_size()
        self.sends = 0
        """Bundles handed to MPI."""
        self._sent: Counter[int] = Counter()
        self._received: Counter[int] = Counter()
        self._arrived: deque[Message] = deque()
        self._outgoing: dict[int, bytearray] = {}
        self._sending: list[tuple[MPI.Request, bytearray]] = []
        self._stall_s = stall_s
        self._recorder = FlightRecorder(folder or Path(gettempdir()), self.rank)
        self._idle_since: float | None = None
        self._waiting_since: float | None = None

    def distances(self, rank: int) -> Sequence[int]:
        """Return 0 for a rank itself, 1 on the same machine, 2 elsewhere."""
        here = self._near[rank]
        row = [1 if node == here else 2 for node in self._near]
        row[rank] = 0
        return row

    def send(self, message: Message) -> None:
        """Send without waiting; it leaves at the next look for messages."""
        if message.target == self.rank:
            self._arrived.append(message)
            return
        self._recorder.note("to", message)
        target = message.target
        record = message.encode(self._sent[target])
        self._sent[target] += 1
        bundle = self._outgoing.get(target)
        if bundle is None:
            bundle = self._outgoing[target] = bytearray()
        bundle += record
        if len(bundle) > LARGEST_BUNDLE:
            self._post(target)

    def poll(self) -> Message | None:
        """Take the next message, those that are here already first."""
        if not self._arrived:
            self.flush()
            self._receive()
        return self._arrived.popleft() if self._arrived else None

    def rest(self, waiting: bool) -> None:
        """Yield the processor, then sleep; raise TransportError after long silence."""
        self.flush()
        now = time.monotonic()
        if self._idle_since is None:
            self._idle_since = now
        if not waiting:
            self._waiting_since = None
        elif self._waiting_since is None:
            self._waiting_since = now
        elif now - self._waiting_since > self._stall_s:
            self._give_up()
        idle_s = now - self._idle_since
        if idle_s < YIELD_S:
            _yield()
        else:
            # the longer nothing comes, the less is looked for it: others need the cores
            time.sleep(max(SLEEP_S, min(idle_s * IDLE_SHARE, LONGEST_SLEEP_S)))

    def meet(self) -> None:
        """Wait until all ranks have come here; TransportError after long silence.

        The barrier does not block inside MPI, where waiting ranks would take the
        processor from those that are late.
        """
        self._await(self._comm.Ibarrier())

    def _await(self, request: MPI.Request) -> None:
        """Wait for what all ranks do, and until what was sent has left."""
        self.flush()
        begun = time.monotonic()
        while not request.Test() or self._sending:
            self._sending = [s for s in self._sending if not s[0].Test()]
            since = time.monotonic() - begun
            if since > self._stall_s:
                raise TransportError(
                    f"Rank {self.rank} waited {self._stall_s:.0f} s for all to meet."
                )
            if since < YIELD_S:
                _yield()
            else:
                time.sleep(SLEEP_S)

    @property
    def is_one_machine(self) -> bool:
        """Return whether all ranks are on this machine."""
        return len(set(self._near)) == 1

    def hear(self, text: str) -> str:
        """Return what rank 0 says; all ranks together."""
        said = np.zeros(LONGEST_TEXT, np.uint8)
        said[: len(text)] = np.frombuffer(text.encode(), np.uint8)
        self._await(self._comm.Ibcast(said))
        return said.tobytes().rstrip(b"\0").decode()

    def agree(self, yes: bool) -> bool:
        """Return whether all ranks say yes; all together."""
        least = np.zeros(1, np.uint8)
        said = np.array([yes], np.uint8)
        self._await(self._comm.Iallreduce(said, least, MPI.MIN))
        return bool(least[0])

    def close(self) -> None:
        """Leave together, when every message has left."""
        left = MPI.COMM_WORLD.Ibarrier()
        while self.is_idle and not left.Test():
            time.sleep(IDLE_S)
        self._await(left)
        self._comm.Free()

    def _join_machine(self) -> None:
        """Become the one rank of a machine that works, or an idle one."""
        rank = self._comm.Get_rank()
        self.is_idle = self._near[rank] != rank
        self.processors = _processors(self._comm)
        comm = self._comm.Split(int(self.is_idle), rank)
        self._comm.Free()
        self._comm = comm
        self._near = self._ranks_of_this_node()

    def flush(self) -> None:
        """Let what was sent leave now."""
        if self._outgoing:
            for target in list(self._outgoing):
                self._post(target)

    def _post(self, target: int) -> None:
        bundle = self._outgoing.pop(target)
        with _told():
            request = self._comm.Isend([bundle, MPI.BYTE], target, _TAG)
        self.sends += 1
        self._sending.append((request, bundle))

    def _receive(self) -> None:
        with _told():
            if self._sending:
                self._sending = [s for s in self._sending if not s[0].Test()]
            status = MPI.Status()
            for _ in range(_PROBES):
                matched = self._comm.Improbe(MPI.ANY_SOURCE, MPI.ANY_TAG, status)
                if matched is not None:
                    break
            else:
                return
            size = status.Get_count(MPI.BYTE)
            if size > LARGEST_BUNDLE + HEADER_BYTES + LARGEST_PAYLOAD:
                raise TransportError(
                    f"Rank {status.Get_source()} sent a message of {size} bytes."
                )
            bundle = np.empty(size, np.uint8)
            matched.Recv([bundle, MPI.BYTE])
        self._idle_since = None
        for record in split_records(bundle.tobytes()):
            message = self._in_order(status.Get_source(), record)
            self._recorder.note("from", message)
            if message.kind in _ANSWERS:
                self._waiting_since = None
            elif message.kind is MessageKind.ABORT:
                raise self._parting(message.payload.decode(errors="replace"))
            self._arrived.append(message)

    def _give_up(self) -> None:
        """Tell all others, and leave them a moment to write down what they know."""
        reason = (
            f"Rank {self.rank} has waited {self._stall_s:.0f} s for a cell; another "
            "rank has stopped answering."
        )
        for target in range(self.ranks):
            if target != self.rank:
                kind = MessageKind.ABORT
                self.send(Message(kind, self.rank, target, 0, 0, reason.encode()))
        self.flush()
        deadline = time.monotonic() + FAREWELL_S
        while time.monotonic() < deadline:
            self._sending = [s for s in self._sending if not s[0].Test()]
            time.sleep(SLEEP_S)
        raise self._parting(reason)

    def _parting(self, reason: str) -> TransportError:
        return TransportError(f"{reason} {self._recorder.write(reason)}")

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
        lowest = np.array([self._comm.Get_rank()], np.int64)
        local.Bcast(lowest)
        local.Free()
        names = np.empty(self._comm.Get_size(), np.int64)
        self._comm.Allgather(lowest, names)
        return [int(name) for name in names]


def _processors(comm: MPI.Comm) -> int:
    """Count a machine's processors that its ranks may use; this process may use all.

    A launcher often binds each rank to one of its own.
    """
    mine = np.zeros(_MOST_PROCESSORS, np.uint8)
    mine[usable_processors()] = 1
    found = np.empty_like(mine)
    local = comm.Split_type(MPI.COMM_TYPE_SHARED)
    local.Allreduce(mine, found, MPI.MAX)
    local.Free()
    usable = np.flatnonzero(found).tolist()
    use_processors(usable)
    return len(usable)
