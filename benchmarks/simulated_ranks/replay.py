"""Rays as lists of the cells they visit, so that a node can be run without a volume."""

from collections.abc import Sequence

from renderers.art.cells.cache import CellCache
from renderers.art.ranks.messages import ProtocolError


class Visits:
    """Follow one packet of rays through its cells.

    cells: in the order in which they are met. seconds: what each costs, once. done:
    visits made.
    """

    __slots__ = ("cells", "done", "seconds")

    def __init__(self, cells: Sequence[int], seconds: Sequence[float] = ()) -> None:
        self.cells = cells
        self.seconds = seconds
        self.done = 0


class ReplayWork:
    """Visit cells at a given cost; nothing is sampled.

    payload: stands for every cell's values. checks: only held cells can be sent, as
    where cells migrate. `spent_s` grows by the cost of visits, `visited` by their
    number. A packet is interrupted when it has cost `slice_s` since it was taken up.
    """

    def __init__(
        self,
        cache: CellCache,
        *,
        payload: bytes = b"",
        slice_s: float = float("inf"),
        checks: bool = True,
    ) -> None:
        self.spent_s = 0.0
        self.visited = 0
        self._cache = cache
        self._payload = payload
        self._slice_s = slice_s
        self._checks = checks

    def tally(self) -> dict[str, int]:
        """Return the number of visits."""
        return {"cells_entered": self.visited}

    def run(self, packets: list[Visits], clock: int) -> list[list[int] | None]:
        """Visit cells until one is missing, the list ends or the slice is over."""
        return [self._run(packet, clock) for packet in packets]

    def result(self, packet: Visits) -> bytes:
        """Write nothing."""
        return b""

    def payload(self, cell: int) -> bytes:
        """Stand for a cell's values; raise ProtocolError when it is not here."""
        if self._checks and not self._cache.holds(cell):
            raise ProtocolError(f"cell {cell} is to be sent and is not here")
        return self._payload

    def read(self, cell: int) -> bytes:
        """Stand for a cell's values, which a file has."""
        return self._payload

    def fill(self, cell: int, slot: int, payload: bytes) -> None:
        """Do nothing: the cache knows that the cell came."""

    def show(self, cells: Sequence[int], slots: Sequence[int]) -> None:
        """Do nothing: what is held can be visited."""

    def hide(self, cell: int) -> None:
        """Do nothing: the cache knows that the cell went."""

    def renew(self, cell: int) -> None:
        """Do nothing: there are no values to read."""

    def _run(self, packet: Visits, clock: int) -> list[int] | None:
        cells, seconds = packet.cells, packet.seconds
        place, stamp = self._cache.place, self._cache.stamp
        spent, k, end = 0.0, packet.done, len(cells)
        stop: list[int] | None = []
        while k < end:
            cell = cells[k]
            slot = place(cell)
            if slot is None:
                stop = [cell]
                break
            if spent >= self._slice_s:
                stop = None
                break
            if clock:
                stamp[slot] = clock
            if seconds:
                spent += seconds[k]
            k += 1
        self.visited += k - packet.done
        packet.done = k
        self.spent_s += spent
        return stop
