"""Whether an arm states the constants that it stated the last time."""

from collections.abc import Sequence

import numpy as np

from devices.microscribe.driver.known_arms import KnownArms, arms_folder, changes
from devices.microscribe.kinematics.constants_check import unusual_constants
from devices.microscribe.wire.link import ArmDescription
from devices.port import DeviceError, DeviceReason
from paravol.checks.finding import Finding

ACCEPT = "--accept-constants"

MOST_LISTED = 4
"""Most changes that are listed; the rest are counted."""


def require_known_constants(arm: ArmDescription, port: str) -> None:
    """Remember a new arm; raise DeviceError(CONSTANTS) when its constants changed.

    So it does for a new arm with constants that no other of its model has. Where
    nothing can be kept, nothing can be compared, and the arm is taken as it is.
    """
    known = KnownArms(arms_folder())
    trouble = _trouble(arm, known)
    if trouble:
        raise DeviceError(
            DeviceReason.CONSTANTS,
            f"The arm {arm.identity.serial!r} on {port} cannot be trusted: {trouble}. "
            f"Look at it by `paravol doctor --device {port}`.",
        )
    try:
        if known.find(arm.identity.serial) is None:
            known.keep(arm)
    except OSError:
        return


def constants_findings(
    arm: ArmDescription, port: str, *, accept: bool
) -> list[Finding]:
    """Tell an arm's constants and whether they are those of the last time.

    ``accept`` keeps them as they are now, whatever they were.
    """
    known = KnownArms(arms_folder())
    return [
        Finding("constants", _table(arm)),
        _history(arm, known, port, accept=accept),
    ]


def _history(
    arm: ArmDescription, known: KnownArms, port: str, *, accept: bool
) -> Finding:
    name = "constants since"
    trouble = "" if accept else _trouble(arm, known)
    if trouble:
        return Finding(
            name,
            trouble,
            is_missing=True,
            remedy="Only the maker's calibration changes them: otherwise they are "
            "damaged, and every pose is wrong. Switch the arm off and on. If they are "
            f"right, `paravol doctor --device {port} {ACCEPT}` keeps them; register "
            "the arm anew then.",
        )
    serial = arm.identity.serial
    try:
        before = None if accept else known.find(serial)
        if before is not None:
            return Finding(name, f"unchanged since {before.seen}")
        known.keep(arm)
    except OSError as error:
        return Finding(
            name,
            "nothing is known",
            remedy=f"{known.file(serial)} cannot be used ({error.strerror}).",
        )
    told = "accepted and kept from now on" if accept else "seen for the first time"
    return Finding(name, f"{told}, in {known.file(serial)}")


def _trouble(arm: ArmDescription, known: KnownArms) -> str:
    """Return why constants are not to be believed; empty when they are."""
    try:
        before = known.find(arm.identity.serial)
    except OSError:
        before = None
    if before is None:
        unusual = unusual_constants(arm.geometry, arm.identity.model)
        return (
            f"no other arm of model {arm.identity.model!r} has such constants: "
            f"{unusual}"
            if unusual
            else ""
        )
    told = changes(before, arm)
    if not told:
        return ""
    more = f", {len(told) - MOST_LISTED} more" if len(told) > MOST_LISTED else ""
    return (
        f"its constants changed since {before.seen}: "
        f"{', '.join(told[:MOST_LISTED])}{more}"
    )


def _table(arm: ArmDescription) -> str:
    geometry = arm.geometry
    turns = " ".join(map(str, arm.encoders.turn))
    return (
        f"a {_row(geometry.a_mm.tolist())} mm; d {_row(geometry.d_mm.tolist())} mm; "
        f"alpha {_row(np.degrees(geometry.alpha).tolist())} degrees; "
        f"beta {np.degrees(geometry.beta):.2f} degrees; {turns} counts per turn"
    )


def _row(values: Sequence[float]) -> str:
    return " ".join(f"{value:.2f}" for value in values)
