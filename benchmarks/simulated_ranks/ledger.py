"""Where a simulated rank's time goes."""

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
