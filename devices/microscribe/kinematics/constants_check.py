"""Whether the constants that an arm states can be those of a MicroScribe.

The block that carries them has no checksum, and a wrong constant turns every pose into
a wrong one that looks well. All MicroScribes are built alike: joints square or parallel
to one another to a fraction of a degree, two long links, small offsets at the joints.
"""

from collections.abc import Callable

import numpy as np

from devices.microscribe.kinematics.arm import JOINTS, ArmGeometry
from devices.microscribe.kinematics.profiles import NOMINAL
from devices.port import DeviceError, DeviceReason

# Models whose constants are known of two arms. These differ from the nominal ones by
# 0.17 degrees and 0.36 mm at most.
KNOWN_MODELS = frozenset({"D", "DX"})
KNOWN_TWIST_DEG = 0.5
KNOWN_LENGTH_MM = 2.0

# Styli differ: a ball tip is 6 mm shorter than a point, an extended one longer.
KNOWN_STYLUS_MM = 20.0

# No other angle makes these joints, whatever the model.
ANY_TWIST_DEG = 3.0
ANY_OFFSET_MM = 15.0

# The large models reach a third further.
ANY_LINK_RATIO = 2.0
LINK_MM = 100.0
"""A nominal length from this on is a link, a shorter one an offset."""

STYLUS = "d 5"

# More names than that say no more.
MOST_NAMED = 3


def constants_by_name(geometry: ArmGeometry) -> dict[str, float]:
    """Return the 19 constants that an arm states; alpha and beta in degrees, mm."""
    named = {f"alpha {i}": float(np.degrees(geometry.alpha[i])) for i in range(JOINTS)}
    named["beta"] = float(np.degrees(geometry.beta))
    named |= {f"a {i}": float(geometry.a_mm[i]) for i in range(JOINTS)}
    named |= {f"d {i}": float(geometry.d_mm[i]) for i in range(JOINTS)}
    return named


def unit_of(name: str) -> str:
    """Return the unit of a constant by its name."""
    return "mm" if name[0] in "ad" and name[1] == " " else "degrees"


def refuse_impossible(geometry: ArmGeometry, port: str) -> None:
    """Raise DeviceError(CONSTANTS) for constants that no MicroScribe can have."""
    beyond = _beyond(geometry, _any_room)
    if beyond:
        raise DeviceError(
            DeviceReason.CONSTANTS,
            f"The arm on {port} states constants that no MicroScribe can have: "
            f"{beyond}. Switch it off and on; if they stay so, only its maker can "
            "restore them.",
        )


def unusual_constants(geometry: ArmGeometry, model: str) -> str:
    """Return the constants that no other arm of this model has, empty for none.

    Only models whose constants are known are judged.
    """
    return _beyond(geometry, _known_room) if model in KNOWN_MODELS else ""


def _known_room(name: str, nominal: float) -> tuple[float, float]:
    if unit_of(name) == "degrees":
        return nominal - KNOWN_TWIST_DEG, nominal + KNOWN_TWIST_DEG
    room = KNOWN_STYLUS_MM if name == STYLUS else KNOWN_LENGTH_MM
    return nominal - room, nominal + room


def _any_room(name: str, nominal: float) -> tuple[float, float]:
    if unit_of(name) == "degrees":
        return nominal - ANY_TWIST_DEG, nominal + ANY_TWIST_DEG
    if abs(nominal) < LINK_MM:
        return nominal - ANY_OFFSET_MM, nominal + ANY_OFFSET_MM
    ends = sorted((nominal / ANY_LINK_RATIO, nominal * ANY_LINK_RATIO))
    return ends[0], ends[1]


def _beyond(
    geometry: ArmGeometry, room: Callable[[str, float], tuple[float, float]]
) -> str:
    """Return the constants outside their range, empty when there are none."""
    nominal = constants_by_name(NOMINAL.geometry)
    found = []
    for name, value in constants_by_name(geometry).items():
        least, most = room(name, nominal[name])
        if not least <= value <= most:
            unit = unit_of(name)
            found.append(f"{name} is {value:.2f} {unit} ({least:.2f} to {most:.2f})")
    more = [f"{len(found) - MOST_NAMED} more"] if len(found) > MOST_NAMED else []
    return ", ".join(found[:MOST_NAMED] + more)
