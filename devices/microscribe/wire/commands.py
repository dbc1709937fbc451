"""Everything the host may say to a MicroScribe.

A command outside this list cannot be built, and the list is finite. The device has four
more, which rewrite its calibration memory (C3, C7, D0, D1), and one that changes its
rate (C4): no trainer has a reason to send them, so they do not exist here. Those four
want the arm's serial number as a password; no byte in the list is a digit, so that even
an arm which misunderstands where a command begins is never told its number.
"""

from dataclasses import dataclass
from enum import Enum
from functools import cache

from devices.microscribe.wire.packets import PacketLayout
from system import UserError


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

    @property
    def words(self) -> str:
        """Return what is asked for, as a person reads it."""
        return _WORDS.get(self, self.name.lower().replace("_", " "))


_WORDS = {
    Query.PARAMETERS: "joint parameters",
    Query.HOME: "command to home",
    Query.END: "end of the session",
    Query.MAXIMA: "largest counts",
    Query.SERIAL: "serial number",
    Query.FORMAT: "parameter format",
    Query.FIRMWARE: "firmware version",
    Query.EXTENDED: "second elbow angle (BETA)",
}


# END goes in front: bare letters "IMMC" reach an open session as four commands, the
# last of which asks for a calibration password. One write keeps a device at another
# rate from misreading them as a change of rate.
SIGN_ON_BYTES = b"\xc5IMMC"

# Straight after a sign-on echo and once only: in an open session its "B" would home
# the arm and its "E" end the session.
BEGIN_BYTES = b"BEGIN"

# The most that any command takes: the parameter block, which another host may have been
# allowed to write before it died.
LONGEST_ARGUMENTS = 36

# Brings an arm out of whatever a dead host left half said, before the letters "IMMC"
# are said for the first time: behind an END that was taken for an argument their "C"
# would be "set the home position". 80 is a poll to an open session, in no serial
# number, and 115200 where a rate is awaited; the zero ends a password; ENDs fill up
# what is left of any arguments, and the last one ends the session. Their number is
# chosen so that no receiver at another rate reads a dangerous command.
CLEAR_BYTES = b"\x80\x00".ljust(LONGEST_ARGUMENTS + 1, b"\xc5")

MOTION = 0xCF
_MOTION_ARGUMENTS = 24
_RESERVED_BIT = 0x10

# Six encoders with the timer: what a pose is made of.
POSE_LAYOUT = PacketLayout(0x23)

# Buttons only; the shortest question there is.
PING_LAYOUT = PacketLayout(0x00)

# 60 Hz. An arm that a dead host left in the middle of a command takes the beginning
# of ours for arguments and the rest for commands; periods up to here are harmless
# then, while 67 would be "set the home position".
LONGEST_PERIOD = 15

# Bit 4 drives analog outputs in a sister product; nothing here needs it.
STANDARD_COMMANDS = tuple(c for c in range(0x40) if not c & _RESERVED_BIT)


def _stream_bytes(period_ticks: int) -> bytes:
    head = bytes((MOTION, 0, period_ticks, POSE_LAYOUT.command))
    # No thresholds: packets come at an even rate, moved or not, and silence is news.
    return head.ljust(1 + _MOTION_ARGUMENTS, b"\0")


ALLOWED = frozenset(
    (
        SIGN_ON_BYTES,
        BEGIN_BYTES,
        CLEAR_BYTES,
        *(bytes((query.value,)) for query in Query),
        *(bytes((command,)) for command in STANDARD_COMMANDS),
        *(_stream_bytes(ticks) for ticks in range(LONGEST_PERIOD + 1)),
    )
)


@dataclass(frozen=True, slots=True)
class Command:
    """Bytes that the host may send in one write."""

    data: bytes

    def __post_init__(self) -> None:
        if self.data not in ALLOWED:
            raise UserError(f"{self.data.hex(' ')} is no command the host may send")


SIGN_ON = Command(SIGN_ON_BYTES)
BEGIN = Command(BEGIN_BYTES)
CLEAR = Command(CLEAR_BYTES)


def ask(query: Query) -> Command:
    """Return a configuration command."""
    return Command(bytes((query.value,)))


@cache
def poll(layout: PacketLayout) -> Command:
    """Return the command for one packet of ``layout``."""
    return Command(bytes((layout.command,)))


def stream(period_ticks: int) -> Command:
    """Return the command for poses every ``period_ticks`` of 1/900 s; 0 = at once."""
    if not 0 <= period_ticks <= LONGEST_PERIOD:
        raise UserError(
            f"period must be 0..{LONGEST_PERIOD} ticks of 1/900 s, got {period_ticks}"
        )
    return Command(_stream_bytes(period_ticks))
