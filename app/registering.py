"""Registration at the start of a session: touch the fiducials, fit, report."""

import numpy as np
from numpy.typing import NDArray

from app.flight import OrderedPoses
from app.operating_room import Progress
from devices import Registration, TouchCollector, register

PATIENCE_S = 30.0
"""A person may take this long from one fiducial to the next."""


def register_by_touch(
    source: OrderedPoses,
    fiducials: dict[str, NDArray[np.float64]],
    progress: Progress,
) -> Registration:
    """Wait until every fiducial has been touched, in order, and fit.

    Raises TimeoutError when nothing is touched for `PATIENCE_S`, RegistrationError
    when the touched points do not fit.
    """
    touches = TouchCollector()
    wanted = len(fiducials)
    quiet_since: float | None = None
    progress("Touching the fiducials", 0.0)
    while len(touches.points_mm) < wanted:
        pose = source.read(PATIENCE_S)
        if touches.feed(pose) is not None:
            progress("Touching the fiducials", len(touches.points_mm) / wanted)
            quiet_since = pose.time_s
        elif quiet_since is None:
            quiet_since = pose.time_s
        if pose.time_s - quiet_since > PATIENCE_S:
            name = list(fiducials)[len(touches.points_mm)]
            raise TimeoutError(
                f"Nobody touched the fiducial {name!r} for {PATIENCE_S:g} seconds; "
                "hold the stylus on it and press the right pedal."
            )
    return register(
        np.stack(touches.points_mm),
        np.stack(list(fiducials.values())),
        list(fiducials),
    )
