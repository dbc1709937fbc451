"""Arms whose constants are known."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches

from devices.microscribe.kinematics.arm import ArmGeometry, Encoders
from devices.microscribe.wire.identity import ArmIdentity, Maxima
from system import UserError

# Counts of a real arm as recorded in its rest: stylus within half a degree of
# vertical, 75 mm beside the base axis. Encoder 5 is not built in; its place in the
# packet holds a constant.
HOME_COUNTS = (13903, 6238, 6868, 4098, 3193, 8416)

# Bits 1-0 of a standard command -> encoders in the packet; not in numeric order.
MICROSCRIBE_CODES = {0b00: 0, 0b01: 5, 0b11: 6, 0b10: 7}

# The Interface Box, a sibling that speaks nearly the same.
INTERFACE_BOX_CODES = {0b00: 0, 0b01: 2, 0b10: 4, 0b11: 6}


@dataclass(frozen=True, slots=True)
class ArmProfile:
    """Everything one arm says about itself, as it says it."""

    identity: ArmIdentity
    maxima: Maxima
    dh_words: tuple[int, ...]
    """ALPHA0..5, A0..5, D0..5."""
    beta_word: int
    home_counts: tuple[int, ...] = HOME_COUNTS
    encoder_codes: Mapping[int, int] = field(default_factory=MICROSCRIBE_CODES.copy)
    """Encoders in a packet, by the two lowest bits of a command."""
    needs_home_button: bool = False
    """Whether it measures nothing until its Home button was pressed."""
    has_roll_index: bool = False
    """Whether bit 2 of the buttons is the index mark of the roll encoder."""

    @property
    def geometry(self) -> ArmGeometry:
        """Return the kinematics in radians and mm."""
        return ArmGeometry.from_words(self.dh_words, self.beta_word)

    @property
    def encoders(self) -> Encoders:
        """Return the resolution of the joints."""
        return Encoders(self.maxima.counts_per_turn)


def _identity(serial: str) -> ArmIdentity:
    return ArmIdentity(
        product_name="MicroScribe3D",
        product_id="MSCR",
        model="DX",
        serial=serial,
        comment="Standard+Beta",
        parameter_format="Format DH0.5",
        firmware="HCI 2.0",
    )


_FIVE_JOINTS = Maxima(
    buttons=3,
    timer=0x3FFF,
    analog=(0,) * 8,
    encoders=(0x3FFF, 0x3FFF, 0x1FFF, 0x0FFF, 0x0FFF, 0),
)

DX40937 = ArmProfile(
    identity=_identity("EMU00001"),
    maxima=_FIVE_JOINTS,
    dh_words=(
        *(0, 16373, -7, 16357, -16382, -16372),
        *(0, 960, 10256, 533, -401, 399),
        *(8300, -878, -3, 9244, 320, -5274),
    ),
    beta_word=3,
)

SECOND_3DX = ArmProfile(
    identity=_identity("EMU00002"),
    maxima=_FIVE_JOINTS,
    dh_words=(
        *(0, 16353, 28, 16354, -16403, -16371),
        *(0, 957, 10252, 547, -400, 400),
        *(8300, -876, -1, 9246, 320, -5276),
    ),
    beta_word=-29,
)

NOMINAL = ArmProfile(
    identity=_identity("EMU00003"),
    maxima=_FIVE_JOINTS,
    dh_words=(
        *(0, 16384, 0, 16384, -16384, -16384),
        *(0, 960, 10250, 540, -400, 400),
        *(8300, -877, 0, 9245, 320, -5285),
    ),
    beta_word=0,
)

# Without the second elbow angle: a request for it stays unanswered.
STANDARD = replace(
    DX40937, identity=replace(_identity("EMU00004"), comment="Standard"), beta_word=0
)

# No capture of a six-joint arm is public. 2000 counts per turn of the stylus is what
# the vendor's library bounds the roll by; they do not divide the 14-bit field.
SIX_JOINTS = replace(
    DX40937,
    identity=replace(_identity("EMU00006"), model="6DOF"),
    maxima=replace(
        _FIVE_JOINTS,
        buttons=7,
        encoders=(0x3FFF, 0x3FFF, 0x1FFF, 0x0FFF, 0x0FFF, 0x07CF),
    ),
    home_counts=(*HOME_COUNTS[:5], 0),
    has_roll_index=True,
)

INTERFACE_BOX = replace(
    DX40937,
    identity=replace(
        _identity("EMU00007"),
        product_name="Interface Box",
        product_id="IBOX",
        model="IBox",
        comment="Standard",
    ),
    beta_word=0,
    encoder_codes=INTERFACE_BOX_CODES,
)

# Real arms repeat one maximum in three places, which hides a reader that is off by
# some bytes. Here all differ, and two are no power of two minus one.
ODD_MAXIMA = replace(
    DX40937,
    identity=_identity("EMU00009"),
    maxima=replace(
        _FIVE_JOINTS, timer=0x3A97, encoders=(0x3E7F, 0x3FFF, 0x1FFF, 0x0FFF, 0x0F9F, 0)
    ),
)

G2_UNHOMED = replace(
    DX40937, identity=replace(_identity("EMU00024"), model="G2"), needs_home_button=True
)

PROFILES = {
    "dx40937": DX40937,
    "3dx_b": SECOND_3DX,
    "nominal": NOMINAL,
    "standard": STANDARD,
    "6dof": SIX_JOINTS,
    "ibox": INTERFACE_BOX,
    "odd_maxima": ODD_MAXIMA,
    "g2_unhomed": G2_UNHOMED,
}

PROFILE_ALIASES = {
    "dx": "dx40937",
    "3dx": "3dx_b",
    "t9": "odd_maxima",
    "g2": "g2_unhomed",
}


def profile_named(name: str) -> ArmProfile:
    """Return a profile by its name or short name; raise ValueError with the nearest."""
    found = PROFILES.get(PROFILE_ALIASES.get(name, name))
    if found is not None:
        return found
    near = get_close_matches(name, [*PROFILES, *PROFILE_ALIASES], 1, 0.4)
    hint = f"; the nearest is {near[0]!r}" if near else ""
    raise UserError(
        f"profile must be one of {', '.join(PROFILES)} (short: "
        f"{', '.join(PROFILE_ALIASES)}), got {name!r}{hint}"
    )
