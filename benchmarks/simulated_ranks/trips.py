"""Rays that travel between simulated ranks: strands, as `MarchTravel` moves real rays.

A message has the length that its rays have on their way between real ranks, and says
which strands they are and how far each has come.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.simulated_ranks.strands import Strand, StrandPacket, StrandWork
from renderers.art.march import COUNTERS
from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.ray_node import RayNode
from renderers.art.ranks.ray_travel import (
    FRONT_BYTES,
    HEADER_BYTES,
    RAY_BYTES,
    RETURN_BYTES,
)

_HEADER = np.dtype([("origin", "<u4"), ("number", "<u4"), ("strands", "<u4")])
_STRAND = np.dtype([("index", "<u4"), ("at", "<u4")])

_NO_WORK = np.zeros(len(COUNTERS))


@dataclass(slots=True, eq=False)
class StrandTrip:
    """Hold strands of one packet together, as `ray_travel.Trip` does with rays.

    places: of the packet's strands, their places in the packet as it began.
    """

    origin: int
    number: int
    places: list[int]
    packet: StrandPacket
    away: int = 0


Begun = dict[tuple[int, int], StrandPacket]
"""What each packet was when it began, by rank and number: what all ranks share, since
strands' cells need not be sent."""


class StrandTravel:
    """Move trips through the cells a rank owns. strands: the work of moving them."""

    def __init__(
        self, work: StrandWork, rank: int, owner: NDArray[np.int64], begun: Begun
    ) -> None:
        """Take a rank's work, each cell's owner, and what all ranks share."""
        self.strands = work
        self._rank = rank
        self._owner = owner
        self._begun = begun
        self._trips: dict[int, StrandTrip] = {}
        self._number = 0
        self._rays_sent = 0

    @property
    def spent_s(self) -> float:
        """Return the seconds that all work so far has cost."""
        return self.strands.spent_s

    def start(self, packet: StrandPacket) -> StrandTrip:
        """Number a packet that begins here."""
        number = self._number
        self._begun[self._rank, number] = packet.fresh()
        places = list(range(len(packet.strands)))
        trip = self._trips[number] = StrandTrip(self._rank, number, places, packet)
        self._number += 1
        return trip

    def is_own(self, trip: StrandTrip) -> bool:
        """Return whether a trip's packet is whole and at home."""
        return self._trips.get(trip.number) is trip

    def move(self, trip: StrandTrip) -> bool:
        """Go on until every strand is finished or needs another rank's cell."""
        stops = self.strands.run([trip.packet], 0)[0]
        if stops is None:
            return False
        here = [cell for cell in stops if self._owner[cell] == self._rank]
        for cell in here:
            self.strands.show(cell, 0)
        return not here

    def send_off(self, trip: StrandTrip) -> list[tuple[int, bytes]]:
        """Take out the strands that stopped, by the owner of what they need."""
        packet = trip.packet
        stopped: dict[int, list[int]] = {}
        left = []
        for k, strand in enumerate(packet.strands):
            if strand.at < len(strand.cells):
                owner = int(self._owner[strand.cells[strand.at]])
                stopped.setdefault(owner, []).append(k)
            else:
                left.append(k)
        parts = []
        for owner, which in sorted(stopped.items()):
            rays = sum(packet.strands[k].rays for k in which)
            each = RAY_BYTES + FRONT_BYTES * packet.has_front
            parts.append((owner, _pack(trip, which, rays * each)))
            self._rays_sent += rays
            if self.is_own(trip):
                trip.away += rays
        trip.places = [trip.places[k] for k in left]
        packet.strands = [packet.strands[k] for k in left]
        if not self.is_own(trip):
            packet.rays = sum(strand.rays for strand in packet.strands)
        return parts

    def send_home(self, trip: StrandTrip) -> tuple[int, bytes] | None:
        """Write a guest's finished strands."""
        packet = trip.packet
        if not packet.strands:
            return None
        which = list(range(len(packet.strands)))
        return trip.origin, _pack(trip, which, packet.rays * RETURN_BYTES)

    def welcome(self, payload: bytes) -> StrandTrip:
        """Make a guest."""
        origin, number, rows = _unpack(payload)
        begun = self._begun[origin, number]
        strands = []
        for index, at in rows:
            strand = begun.strands[index]
            strands.append(Strand(strand.cells, strand.work, strand.rays, at))
        rays = sum(strand.rays for strand in strands)
        packet = StrandPacket(
            strands, rays, _NO_WORK, 0, has_begun=True, has_front=begun.has_front
        )
        return StrandTrip(origin, number, [index for index, _ in rows], packet)

    def take_home(self, payload: bytes) -> StrandTrip:
        """Count finished strands as at home."""
        origin, number, rows = _unpack(payload)
        trip = self._trips.get(number)
        if origin != self._rank or trip is None:
            raise ProtocolError(f"rays of packet {number} of rank {origin} came here")
        begun = self._begun[origin, number]
        rays = sum(begun.strands[index].rays for index, _ in rows)
        if rays > trip.away:
            raise ProtocolError(f"packet {number} never sent the rays that came back")
        trip.away -= rays
        return trip

    def settle(self, trip: StrandTrip) -> bytes | None:
        """Write a packet whose rays are all at home."""
        if trip.away:
            return None
        del self._trips[trip.number], self._begun[self._rank, trip.number]
        return self.strands.result(trip.packet)

    def forget(self) -> None:
        """Drop the trips of a frame that was given up."""
        self._trips.clear()

    def tally(self) -> dict[str, int]:
        """Return the number of visits, and of rays sent."""
        return self.strands.tally() | {"rays_sent": self._rays_sent}


StrandRayNode = RayNode[StrandPacket, StrandTrip]


def _pack(trip: StrandTrip, which: list[int], size: int) -> bytes:
    head = np.array([(trip.origin, trip.number, len(which))], _HEADER)
    rows = [(trip.places[k], trip.packet.strands[k].at) for k in which]
    text = head.tobytes() + np.array(rows, _STRAND).tobytes()
    return text.ljust(HEADER_BYTES + size, b"\0")


def _unpack(payload: bytes) -> tuple[int, int, list[tuple[int, int]]]:
    head = np.frombuffer(payload, _HEADER, 1)[0]
    rows = np.frombuffer(payload, _STRAND, int(head["strands"]), _HEADER.itemsize)
    return int(head["origin"]), int(head["number"]), rows.tolist()
