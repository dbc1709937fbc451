"""Everything the host may say to a MicroScribe.

A command outside this list cannot be built. The device has four more, which rewrite
its calibration memory (C3, C7, D0, D1), and one that changes its rate (C4): no trainer
has a reason to send them, so they do not exist here.
"""

from dataclasses import dataclass
from enum import Enum

from devices.microscribe.packets import Layout


class Query(Enum):
    """Configuration commands, by the byte that is sent and echoed."""

    PARAMETERS = 0xC0
    HOME = 0xC2
    END = 0xC5
    MAXIMA = 0xC6
    PRODUCT_NAME = 0xC8
    PRODUCT_ID = 0xC9
    MODEL = 0xCA
    SERIAL = 0xCB
    COMMENT = 0xCC
    FORMAT = 0xCD
    FIRMWARE = 0xCE
    EXTENDED = 0xD3


# END goes in front: bare letters "IMMC" reach an open session as four commands, the
# last of which asks for a calibration password. One write keeps a device at another
# rate from misreading them as a change of rate.
SIGN_ON_BYTES = b"\xc5IMMC"

# Straight after a sign-on echo and once only: in an open session its "B" would home
# the arm and its "E" end the session.
BEGIN_BYTES = b"BEGIN"

# Ends a password that a dead host left half asked for.
ONE_ZERO = b"\x00"

# Completes a motion command that a dead host left half sent: 24 arguments, or 26 with
# seven encoders. More would feed zeros to a half-sent parameter write.
MANY_ZEROS = bytes(26)

MOTION = 0xCF
_MOTION_ARGUMENTS = 24
_RESERVED_BIT = 0x10
_SEVEN_ENCODERS = 0b10

# Bit 4 drives analog outputs in a sister product; nothing here needs it.
STANDARD_COMMANDS = tuple(c for c in range(0x40) if not c & _RESERVED_BIT)

_FIXED = frozenset(
    (
        SIGN_ON_BYTES,
        BEGIN_BYTES,
        MANY_ZEROS,
        *(bytes((query.value,)) for query in Query),
        *(bytes((command,)) for command in STANDARD_COMMANDS),
    )
)


@dataclass(frozen=True, slots=True)
class Command:
    """Bytes that the host may send in one write."""

    data: bytes

    def __post_init__(self) -> None:
        if self.data not in _FIXED and not _is_fixed_rate_stream(self.data):
            raise ValueError(f"{self.data.hex(' ')} is no command the host may send")


def _is_fixed_rate_stream(data: bytes) -> bool:
    return (
        len(data) == 1 + _MOTION_ARGUMENTS
        and data[0] == MOTION
        and data[3] in STANDARD_COMMANDS
        and data[3] & 0b11 != _SEVEN_ENCODERS
        and not any(data[4:])
    )


SIGN_ON = Command(SIGN_ON_BYTES)
BEGIN = Command(BEGIN_BYTES)
PING = Command(ONE_ZERO)
FLUSH_MOTION = Command(MANY_ZEROS)


def ask(query: Query) -> Command:
    """Return a configuration command."""
    return Command(bytes((query.value,)))


def poll(layout: Layout) -> Command:
    """Return the command for one packet of ``layout``."""
    return Command(bytes((layout.command,)))


def stream(layout: Layout, period_ticks: int) -> Command:
    """Return the command for packets every ``period_ticks`` of 1/900 s; 0 = at once."""
    if not 0 <= period_ticks < 1 << 16:
        raise ValueError(f"period must be 0..65535 ticks, got {period_ticks}")
    head = bytes((MOTION,)) + period_ticks.to_bytes(2, "big")
    return Command(head + bytes((layout.command,)) + bytes(_MOTION_ARGUMENTS - 3))


def every_fixed_command() -> frozenset[Command]:
    """Return all commands without arguments of their own."""
    return frozenset(Command(data) for data in _FIXED)
