"""Packets of rays that travel: what goes along with a ray, and how it comes home."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.art.crew import ALONE, Crew
from renderers.art.march import March
from renderers.art.quality import Quality
from renderers.art.ranks.directory import Distances
from renderers.art.ranks.messages import ProtocolError
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.prepare import MarchNode, make_node
from renderers.art.ranks.ray_node import RayNode
from renderers.art.ranks.rays import RayPacket
from renderers.art.ranks.work import MarchWork
from renderers.art.regions import Region
from renderers.scene import Scene
from renderers.scene.deflection import Deflection

_HEADER = np.dtype(
    [("origin", "<u4"), ("number", "<u4"), ("rays", "<u4"), ("front", "<u4")]
)

_NOWHERE = Region(0, 0, 0, 0)

HEADER_BYTES = _HEADER.itemsize


@dataclass(slots=True, eq=False)
class Trip:
    """Rays of one region together: all of them at home, or some as guests.

    origin: the rank whose they are. number: of the region there. rays: their places in
    it. away: of a packet at home, how many are elsewhere.
    """

    origin: int
    number: int
    rays: NDArray[np.int32]
    packet: RayPacket
    away: int = 0


class MarchTravel:
    """March trips through the cells a rank owns."""

    def __init__(self, work: MarchWork, rank: int, owner: NDArray[np.int64]) -> None:
        """Take a rank's cells, and each cell's owner."""
        self._work = work
        self._rank = rank
        self._owner = owner
        self._slots = 0
        self._trips: dict[int, Trip] = {}
        self._number = 0
        self._rays_sent = 0

    def start(self, packet: RayPacket) -> Trip:
        """Number a packet that begins here."""
        rays = np.arange(len(packet.count), dtype=np.int32)
        trip = Trip(self._rank, self._number, rays, packet)
        self._trips[self._number] = trip
        self._number += 1
        return trip

    def is_own(self, trip: Trip) -> bool:
        """Return whether a trip's packet is whole and at home."""
        return self._trips.get(trip.number) is trip

    def move(self, trip: Trip) -> bool:
        """March until every ray is finished or needs another rank's cell."""
        missing = self._work.run([trip.packet], 0)[0]
        here = [cell for cell in missing if self._owner[cell] == self._rank]
        if here:
            self._work.show(here, range(self._slots, self._slots + len(here)))
            self._slots += len(here)
        return not here

    def send_off(self, trip: Trip) -> list[tuple[int, bytes]]:
        """Take out the rays that stopped, by the owner of what they need."""
        packet = trip.packet
        cells = packet.cursor[:-1, 3]
        stopped = np.flatnonzero(cells > 0)
        if not stopped.size:
            return []
        owners = self._owner[cells[stopped] - 1]
        parts = []
        for owner in np.unique(owners).tolist():
            rays = stopped[owners == owner]
            parts.append((int(owner), self._pack(trip, rays, whole=True)))
        if self.is_own(trip):
            trip.away += stopped.size
        else:
            left = np.flatnonzero(cells == 0)
            trip.rays = trip.rays[left]
            for name in ("value", "carry", "depth"):
                setattr(packet, name, getattr(packet, name)[left])
        self._rays_sent += stopped.size
        return parts

    def send_home(self, trip: Trip) -> tuple[int, bytes] | None:
        """Write a guest's finished rays."""
        count = len(trip.rays)
        if not count:
            return None
        return trip.origin, self._pack(trip, np.arange(count), whole=False)

    def welcome(self, payload: bytes) -> Trip:
        """Make a guest; raise ProtocolError when the rays came damaged."""
        origin, number, rays, parts = self._unpack(payload, whole=True)
        n = len(rays)
        order = np.arange(n, dtype=np.int32)
        packet = RayPacket(_NOWHERE, order, *parts[:6])
        if len(parts) > 6:
            packet.front = parts[6]
        return Trip(origin, number, rays, packet)

    def take_home(self, payload: bytes) -> Trip:
        """Put finished rays back where they began."""
        origin, number, rays, parts = self._unpack(payload, whole=False)
        trip = self._trips.get(number)
        if origin != self._rank or trip is None:
            raise ProtocolError(f"rays of packet {number} of rank {origin} came here")
        value, carry, depth = parts
        packet = trip.packet
        if rays.max(initial=0) >= len(packet.depth) or len(rays) > trip.away:
            raise ProtocolError(f"packet {number} never sent the rays that came back")
        packet.value[rays], packet.carry[rays] = value[:-1], carry[:-1]
        packet.depth[rays] = depth
        trip.away -= len(rays)
        return trip

    def settle(self, trip: Trip) -> bytes | None:
        """Write a region whose rays are all at home."""
        if trip.away:
            return None
        del self._trips[trip.number]
        return self._work.result(trip.packet)

    def forget(self) -> None:
        """Drop the trips of a frame that was given up."""
        self._trips.clear()

    def tally(self) -> dict[str, int]:
        """Return the kernels' counters and the rays sent."""
        return self._work.tally() | {"rays_sent": self._rays_sent}

    def _pack(self, trip: Trip, rays: NDArray[np.intp], *, whole: bool) -> bytes:
        packet = trip.packet
        front = whole and len(packet.front) > 0
        head = np.array([(trip.origin, trip.number, len(rays), front)], _HEADER)
        parts = [head.tobytes(), trip.rays[rays].astype("<i4").tobytes()]
        arrays: list[NDArray[Any]] = [packet.value, packet.carry, packet.depth]
        if whole:
            arrays = [packet.geometry, packet.count, packet.cursor, *arrays]
        if front:
            arrays.append(packet.front)
        parts += [array[rays].tobytes() for array in arrays]
        return b"".join(parts)

    def _unpack(
        self, payload: bytes, *, whole: bool
    ) -> tuple[int, int, NDArray[np.int32], list[NDArray[Any]]]:
        """Read what `_pack` wrote; arrays of rows get one to spare, as kernels need."""
        columns = [(4, "<f4"), (4, "<f4"), (1, "<f4")]
        if whole:
            columns = [(8, "<f4"), (1, "<i4"), (4, "<i4"), *columns]
        start = payload[: _HEADER.itemsize].ljust(_HEADER.itemsize, b"\0")
        head = np.frombuffer(start, _HEADER)[0]
        if whole and head["front"]:
            columns.append((4, "<f4"))
        n = int(head["rays"])
        size = _HEADER.itemsize + 4 * n * (1 + sum(wide for wide, _ in columns))
        if len(payload) != size:
            raise ProtocolError(f"{n} rays came with {len(payload)} bytes, not {size}")
        rays = np.frombuffer(payload, "<i4", n, _HEADER.itemsize)
        at = _HEADER.itemsize + 4 * n
        parts: list[NDArray[Any]] = []
        for wide, kind in columns:
            found = np.frombuffer(payload, kind, n * wide, at)
            at += 4 * n * wide
            if wide > 1:
                spare = np.zeros((n + 1, wide), kind)
                spare[:-1] = found.reshape(n, wide)
                parts.append(spare)
            else:
                parts.append(found.copy())
        return int(head["origin"]), int(head["number"]), rays, parts


MarchRayNode = RayNode[RayPacket, Trip]


def make_frame_node(
    scene: Scene,
    mode: str,
    quality: Quality,
    policy: CellPolicy,
    *,
    rank: int = 0,
    ranks: int = 1,
    distances: Distances | None = None,
    cell_side: int | None = 8,
    validate: bool = False,
    deflection: Deflection | None = None,
    crew: Crew = ALONE,
) -> tuple[March, MarchNode | MarchRayNode, MarchWork]:
    """Prepare one rank for any dataflow; see `make_node`.

    Raise ValueError for rays that shall travel and are deflected.
    """
    is_deflected = deflection is not None and bool(deflection.deflectors)
    if is_deflected and policy.dataflow is Dataflow.RAYS:
        raise ValueError(
            "deflected rays do not travel between ranks; start the worker with another "
            "--dataflow than rays"
        )
    if policy.dataflow is Dataflow.RAYS:
        # No cell is copied, and a rank has all that it owns.
        policy = replace(policy, cache_cells=None)
    march, node, work = make_node(
        scene,
        mode,
        quality,
        rank=rank,
        ranks=ranks,
        policy=policy,
        distances=distances,
        cell_side=cell_side,
        validate=validate,
        deflection=deflection,
        crew=crew,
    )
    if policy.dataflow is not Dataflow.RAYS:
        return march, node, work
    travel = MarchTravel(work, rank, node.directory.home_of)
    return march, MarchRayNode(travel, rank), work
