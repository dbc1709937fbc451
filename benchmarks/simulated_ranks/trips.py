"""Rays that travel between simulated ranks, as `MarchTravel` moves real rays.

Rays that need the same cells one after another make a strand. A message has the length
that its rays have on their way between real ranks, and says which strands they are and
how far each has come.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.ray_node import RayNode
from renderers.art.ranks.ray_travel import HEADER_BYTES

RAY_BYTES = 92
"""Of a ray on its way: number, geometry, samples, cursor, two sums and depth."""

RETURN_BYTES = 40
"""Of a ray that comes home: number, two sums and depth."""


@dataclass(slots=True)
class Strand:
    """Follow rays that need the same cells. seconds: what each cell costs them all."""

    cells: tuple[int, ...]
    seconds: Sequence[float]
    rays: int
    at: int = 0


StrandPacket = list[Strand]


@dataclass(slots=True, eq=False)
class StrandTrip:
    """Hold strands of one packet together, as `ray_travel.Trip` does with rays.

    strands: by their places in the packet as it began. away: rays at other ranks.
    """

    origin: int
    number: int
    strands: dict[int, Strand]
    away: int = 0


Begun = dict[tuple[int, int], StrandPacket]
"""What each packet was when it began, by rank and number: what all ranks share, since
strands' cells need not be sent."""


class StrandTravel:
    """Move trips through the cells a rank owns; nothing is sampled.

    `spent_s` is what moving has cost so far. A packet is interrupted when moving its
    strands has cost `slice_s` since it was taken up.
    """

    def __init__(
        self,
        rank: int,
        owner: NDArray[np.int64],
        begun: Begun,
        *,
        slice_s: float = math.inf,
    ) -> None:
        """Take a rank's number, each cell's owner, and what all ranks share."""
        self.spent_s = 0.0
        self._rank = rank
        self._owner = owner
        self._begun = begun
        self._slice_s = slice_s
        self._trips: dict[int, StrandTrip] = {}
        self._number = 0
        self._rays_sent = 0

    def start(self, packet: StrandPacket) -> StrandTrip:
        """Number a packet that begins here."""
        number = self._number
        self._begun[self._rank, number] = packet
        strands = {place: replace(strand) for place, strand in enumerate(packet)}
        trip = self._trips[number] = StrandTrip(self._rank, number, strands)
        self._number += 1
        return trip

    def is_own(self, trip: StrandTrip) -> bool:
        """Return whether a trip's packet is whole and at home."""
        return self._trips.get(trip.number) is trip

    def move(self, trip: StrandTrip) -> bool:
        """Go on until every strand is finished or needs another rank's cell."""
        owner, spent = self._owner, 0.0
        for strand in trip.strands.values():
            cells = strand.cells
            while strand.at < len(cells) and owner[cells[strand.at]] == self._rank:
                if spent >= self._slice_s:
                    self.spent_s += spent
                    return False
                spent += strand.seconds[strand.at]
                strand.at += 1
        self.spent_s += spent
        return True

    def send_off(self, trip: StrandTrip) -> list[tuple[int, bytes]]:
        """Take out the strands that stopped, by the owner of what they need."""
        stopped: dict[int, dict[int, Strand]] = {}
        for place, strand in trip.strands.items():
            if strand.at < len(strand.cells):
                owner = int(self._owner[strand.cells[strand.at]])
                stopped.setdefault(owner, {})[place] = strand
        parts = []
        for owner, strands in sorted(stopped.items()):
            for place in strands:
                del trip.strands[place]
            rays = _rays(strands)
            parts.append((owner, _pack(trip, strands, rays * RAY_BYTES)))
            self._rays_sent += rays
            if self.is_own(trip):
                trip.away += rays
        return parts

    def send_home(self, trip: StrandTrip) -> tuple[int, bytes] | None:
        """Write a guest's finished strands."""
        if not trip.strands:
            return None
        size = _rays(trip.strands) * RETURN_BYTES
        return trip.origin, _pack(trip, trip.strands, size)

    def welcome(self, payload: bytes) -> StrandTrip:
        """Make a guest."""
        origin, number, places = _unpack(payload)
        begun = self._begun[origin, number]
        strands = {place: replace(begun[place], at=at) for place, at in places}
        return StrandTrip(origin, number, strands)

    def take_home(self, payload: bytes) -> StrandTrip:
        """Count finished strands as at home."""
        origin, number, places = _unpack(payload)
        trip = self._trips.get(number)
        if origin != self._rank or trip is None:
            raise ProtocolError(f"rays of packet {number} of rank {origin} came here")
        begun = self._begun[origin, number]
        rays = sum(begun[place].rays for place, _ in places)
        if rays > trip.away:
            raise ProtocolError(f"packet {number} never sent the rays that came back")
        trip.away -= rays
        return trip

    def settle(self, trip: StrandTrip) -> bytes | None:
        """Write nothing for a packet whose rays are all at home."""
        if trip.away:
            return None
        del self._trips[trip.number], self._begun[self._rank, trip.number]
        return b""

    def forget(self) -> None:
        """Drop the trips of a frame that was given up."""
        self._trips.clear()

    def tally(self) -> dict[str, int]:
        """Return the number of rays sent."""
        return {"rays_sent": self._rays_sent}


StrandRayNode = RayNode[StrandPacket, StrandTrip]


def _rays(strands: dict[int, Strand]) -> int:
    return sum(strand.rays for strand in strands.values())


def _pack(trip: StrandTrip, strands: dict[int, Strand], size: int) -> bytes:
    rows = [(place, strand.at) for place, strand in strands.items()]
    numbers = np.array([(trip.origin, trip.number), (len(rows), 0), *rows], "<u4")
    return numbers.tobytes().ljust(HEADER_BYTES + size, b"\0")


def _unpack(payload: bytes) -> tuple[int, int, list[tuple[int, int]]]:
    numbers = np.frombuffer(payload, "<u4", len(payload) // 8 * 2).reshape(-1, 2)
    (origin, number), (count, _) = numbers[:2].tolist()
    rows = numbers[2 : 2 + count].tolist()
    return origin, number, [(place, at) for place, at in rows]
