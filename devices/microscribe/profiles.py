"""Arms whose constants are known."""

from dataclasses import dataclass

from devices.microscribe.arm import ArmGeometry, Encoders
from devices.microscribe.identity import ArmIdentity, Maxima

# Counts of a real arm as recorded in its rest: stylus within half a degree of
# vertical, 75 mm beside the base axis. Encoder 5 is not built in; its place in the
# packet holds a constant.
HOME_COUNTS = (13903, 6238, 6868, 4098, 3193, 8416)


@dataclass(frozen=True, slots=True)
class ArmProfile:
    """Everything one arm says about itself, as it says it."""

    identity: ArmIdentity
    maxima: Maxima
    dh_words: tuple[int, ...]
    """ALPHA0..5, A0..5, D0..5."""
    beta_word: int
    home_counts: tuple[int, ...] = HOME_COUNTS

    @property
    def geometry(self) -> ArmGeometry:
        """Get the kinematics in radians and mm."""
        return ArmGeometry.from_words(self.dh_words, self.beta_word)

    @property
    def encoders(self) -> Encoders:
        """Get the resolution of the joints."""
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

PROFILES = {"dx40937": DX40937, "3dx_b": SECOND_3DX, "nominal": NOMINAL}
