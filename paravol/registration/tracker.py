"""Registering a tracker of which nothing is known but its poses.

An arm states its joints, from which the errors of its poses follow. A tracker states
nothing, so the error of a touch is taken from how well the landmarks fit: for n points
FLE^2 = FRE^2 n / (n - 2) (Fitzpatrick, West, Maurer 1998), and is never believed to be
better than what is planned for. Errors that all landmarks share do not show there.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from devices import register
from devices.registration.registration_file import RegistrationRecord
from devices.registration.target_error import fitzpatrick_rms_mm, refuse_weak_targets
from paravol.inputs.pose_sources import OrderedPoses
from paravol.registration.at_start import TRACKER
from paravol.registration.fit import Fit, Touched, describe_registration
from paravol.registration.walk import Guide, RegistrationWalk

LEAST_TOUCH_MM = 0.5
"""Error of a touch, rms, that a good fit of few landmarks cannot argue away."""


def register_tracker(
    source: OrderedPoses,
    guide: Guide,
    landmarks: dict[str, NDArray[np.float64]],
    targets: dict[str, NDArray[np.float64]],
    *,
    pivot: bool,
    head: str,
    tool: Callable[[], str | None],
) -> RegistrationRecord:
    """Lead a person through tip and landmarks, and fit.

    ``tool`` is asked afterwards: a source may learn its tool's name from the poses.

    ``landmarks`` and ``targets`` are positions (3,) by name, in the patient, mm. Raise
    as `RegistrationWalk` and RegistrationError as `register` do, and for a target whose
    expected error is beyond what is allowed.
    """
    walk = RegistrationWalk(source, guide)
    calibrated = walk.pivot(along_axis=False) if pivot else None
    held = walk.touch(list(landmarks))
    tips = np.stack([point.tip_mm for point in held])
    places = np.stack(list(landmarks.values()))
    fit = register(tips, places, list(landmarks))
    touch_mm = touch_error_mm(fit.residual_rms_mm, len(tips))
    tip_error_mm = 0.0
    if calibrated is not None:
        tip_error_mm = math.sqrt(float(np.trace(calibrated.covariance)))
    at_targets = fitzpatrick_rms_mm(places, np.stack(list(targets.values())), touch_mm)
    # The tool at a target is measured as wrongly as it was at a landmark.
    expected = np.sqrt(at_targets**2 + touch_mm**2 + tip_error_mm**2)
    by_name = dict(zip(targets, expected.tolist(), strict=True))
    refuse_weak_targets(by_name)
    touched = Touched(held, np.zeros((0, 3)), calibrated)
    found = Fit(fit, by_name, surface_rms_mm=0.0)
    return describe_registration(
        found, touched, landmarks, serial=tool() or "", model=TRACKER, head=head
    )


def touch_error_mm(residual_rms_mm: float, count: int) -> float:
    """Return the error of one touch, rms, that ``count`` landmarks' fit speaks for."""
    told = residual_rms_mm * math.sqrt(count / max(count - 2, 1))
    return max(told, LEAST_TOUCH_MM)
