"""What an emulated arm says, piece by piece."""

from dataclasses import dataclass
from enum import Enum, auto


class AnswerKind(Enum):
    """What a run of bytes from the arm is."""

    ATTENTION = auto()
    """The echo of IMMC."""
    PRODUCT_ID = auto()
    """What BEGIN is answered with."""
    STRING = auto()
    PARAMETERS = auto()
    EXTENDED = auto()
    MAXIMA = auto()
    HOME_REFERENCE = auto()
    ECHO = auto()
    """An echo that is the whole reply."""
    MARKER = auto()
    PASSWORD = auto()
    """Whether a request to write the calibration memory is granted."""
    PACKET = auto()
    FOREIGN = auto()
    """Nothing the arm says: noise, or the host's own bytes."""


class After(Enum):
    """What happens to the line once certain bytes have arrived."""

    STALL = auto()
    """Nothing ever comes again."""
    UNPLUG = auto()
    REPLUG = auto()
    """The port goes away and comes back under another name."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Bytes that belong together."""

    kind: AnswerKind
    data: bytes
    delay_s: float = 0.0
    """Waited before the first byte, on top of what the line needs."""
    after: After | None = None
