"""What an emulated arm says, piece by piece."""

from dataclasses import dataclass
from enum import Enum, auto

from devices.microscribe.kinematics.profiles import ArmProfile
from devices.microscribe.wire.identity import encode_words


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


class ReplyTrigger(Enum):
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
    after: ReplyTrigger | None = None


PARAMETERS, HOME_REFERENCE, MAXIMA, EXTENDED = 0xC0, 0xC1, 0xC6, 0xD3
FIRST_STRING = 0xC8

_HOME_REFERENCE_BYTES = 12


def describe(profile: ArmProfile) -> dict[int, Answer]:
    """Return the answers to all questions without arguments, by the echoed byte.

    A question that is missing here is not answered at all, BETA among them when the
    arm's comment does not announce it.
    """
    about = profile.identity
    texts = (
        about.product_name,
        about.product_id,
        about.model,
        about.serial,
        about.comment,
        about.parameter_format,
        about.firmware,
    )
    block = encode_words(profile.dh_words)
    bodies = {
        PARAMETERS: (AnswerKind.PARAMETERS, bytes((len(block),)) + block),
        # Of no meaning to this arm.
        HOME_REFERENCE: (AnswerKind.HOME_REFERENCE, bytes(_HOME_REFERENCE_BYTES)),
        MAXIMA: (AnswerKind.MAXIMA, profile.maxima.encode()),
        **{
            FIRST_STRING + i: (AnswerKind.STRING, text.encode() + b"\0")
            for i, text in enumerate(texts)
        },
    }
    if about.has_beta:
        beta = encode_words((profile.beta_word,))
        bodies[EXTENDED] = (AnswerKind.EXTENDED, bytes((len(beta),)) + beta)
    return {
        code: Answer(kind, bytes((code,)) + body)
        for code, (kind, body) in bodies.items()
    }
