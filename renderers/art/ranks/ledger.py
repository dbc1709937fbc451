"""Where a rank's time goes, by the same names drawn and simulated."""

from collections.abc import Callable
from dataclasses import dataclass

from renderers.art.ranks.messages import MessageKind

AT_HOME = frozenset(
    (
        MessageKind.REQUEST,
        MessageKind.INVALIDATE_REQUEST,
        MessageKind.ADOPTED,
    )
)
"""What a cell's home is told: the directory's work."""


@dataclass(slots=True)
class Ledger:
    """Say where a rank's time went, seconds; the parts sum to the whole."""

    render: float = 0.0
    lru: float = 0.0
    scan: float = 0.0
    directory: float = 0.0
    receive: float = 0.0
    send: float = 0.0
    poll: float = 0.0
    idle: float = 0.0

    def parts(self) -> dict[str, float]:
        """Return the parts by name."""
        return {name: getattr(self, name) for name in self.__slots__}

    @property
    def busy(self) -> float:
        """Return the seconds of all parts but `idle` and `poll`."""
        return sum(self.parts().values()) - self.idle - self.poll


class Stopwatch:
    """Charge the time since the last lap to a part of a ledger."""

    def __init__(self, clock: Callable[[], float] | None = None) -> None:
        """Take a clock, seconds; without one nothing is measured."""
        self._clock = clock
        self._last = 0.0
        self.ledger = Ledger()
        self.restart()

    def restart(self) -> None:
        """Begin anew with an empty ledger."""
        self.ledger = Ledger()
        if self._clock is not None:
            self._last = self._clock()

    def lap(self, part: str) -> None:
        """Charge what went by."""
        if self._clock is not None:
            now = self._clock()
            ledger = self.ledger
            setattr(ledger, part, getattr(ledger, part) + now - self._last)
            self._last = now
