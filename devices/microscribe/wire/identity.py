"""What a MicroScribe says about itself."""

from dataclasses import dataclass

from devices.port import DeviceError, DeviceReason

_SHOWN = 40


def readable(data: bytes) -> str:
    """Return plain text in quotes, anything else as hexadecimal bytes."""
    if not data:
        return "nothing"
    shown = data[:_SHOWN]
    more = f" and {len(data) - _SHOWN} bytes more" if len(data) > _SHOWN else ""
    if all(32 <= byte < 127 for byte in shown):
        return f"'{shown.decode('ascii')}'{more}"
    return f"the bytes {shown.hex(' ').upper()}{more}"


PRODUCT_ID = "MSCR"
FORMAT = "Format DH0.5"
MAXIMA_BYTES = 24

# The arm answers a request for BETA only if its comment announces it.
EXTENDED_MARK = "Beta"

# Longer than any string of the arm (31 and NUL); bounds a reply without its NUL.
LONGEST_STRING = 39


@dataclass(frozen=True, slots=True)
class ArmIdentity:
    """The seven strings of an arm."""

    product_name: str
    product_id: str
    model: str
    serial: str
    comment: str
    parameter_format: str
    firmware: str

    @property
    def has_beta(self) -> bool:
        """Return whether the arm knows its second elbow angle."""
        return EXTENDED_MARK in self.comment


@dataclass(frozen=True, slots=True)
class Maxima:
    """Largest value of everything an arm reports; 0 = not built in."""

    buttons: int
    timer: int
    analog: tuple[int, ...]
    encoders: tuple[int, ...]

    @property
    def counts_per_turn(self) -> tuple[int, ...]:
        """Return counts per turn of the six joints; 1 where there is no encoder."""
        return tuple(value + 1 for value in self.encoders)

    def encode(self) -> bytes:
        """Return the 24 bytes that follow the echo."""
        words = b"".join(value.to_bytes(2, "big") for value in self.encoders)
        head = bytes([self.buttons]) + self.timer.to_bytes(2, "big")
        return head + bytes(self.analog) + b"\0" + words

    @classmethod
    def decode(cls, payload: bytes) -> "Maxima":
        """Read the 24 bytes; raise DeviceError when joints 0 to 4 lack encoders."""
        if len(payload) != MAXIMA_BYTES:
            raise DeviceError(
                DeviceReason.UNSUPPORTED_FORMAT,
                f"The arm sent {len(payload)} bytes of maxima instead of 24.",
            )
        encoders = tuple(
            int.from_bytes(payload[i : i + 2], "big")
            for i in range(12, MAXIMA_BYTES, 2)
        )
        if 0 in encoders[:5]:
            raise DeviceError(
                DeviceReason.UNSUPPORTED_FORMAT,
                "The arm has no encoder at one of its first five joints; it tells of "
                f"{', '.join(map(str, encoders))} counts.",
            )
        return cls(
            buttons=payload[0],
            timer=int.from_bytes(payload[1:3], "big"),
            analog=tuple(payload[3:11]),
            encoders=encoders,
        )


def decode_words(payload: bytes, count: int, what: str) -> tuple[int, ...]:
    """Read ``count`` signed big-endian words; raise DeviceError at another length."""
    if len(payload) != 2 * count:
        raise DeviceError(
            DeviceReason.UNSUPPORTED_FORMAT,
            f"The arm sent {len(payload)} bytes of {what} instead of {2 * count}.",
        )
    return tuple(
        int.from_bytes(payload[i : i + 2], "big", signed=True)
        for i in range(0, 2 * count, 2)
    )


def encode_words(words: tuple[int, ...]) -> bytes:
    """Return signed big-endian words."""
    return b"".join(word.to_bytes(2, "big", signed=True) for word in words)


def decode_string(payload: bytes) -> str:
    """Read a string reply without its NUL; raise DeviceError unless plain ASCII."""
    if not all(32 <= byte < 127 for byte in payload):
        raise DeviceError(
            DeviceReason.BAD_REPLY,
            f"The arm sent {readable(payload)} where a plain text was expected.",
        )
    return payload.decode("ascii")
