"""One moment of a session as it was measured."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scenarios.endoscope import tip_frame
from scenarios.instrument_state import AS_BEFORE, InstrumentState


@dataclass(frozen=True, slots=True)
class Sample:
    """One moment as it was measured; everything else follows from it.

    device_from_tip: 4x4 pose of the scope's tip in the arm's frame.
    roll_deg: the light post's turn, from the second channel.
    instrument_tip_mm, instrument_pointing: ``(3,)`` patient frame. instrument: what the
    second hand holds and does. is_frozen: the trainer was frozen: nothing counts, and
    the score's clock stands. scope_deg: angle of the scope that was put in instead of
    the exercise's own, None for that. camera_roll_deg: the camera head's turn from
    upright.
    """

    time_s: float
    device_from_tip: NDArray[np.float64]
    roll_deg: float
    instrument_tip_mm: NDArray[np.float64]
    instrument_pointing: NDArray[np.float64]
    buttons: int
    instrument: InstrumentState = AS_BEFORE
    is_frozen: bool = False
    scope_deg: float | None = None
    camera_roll_deg: float = 0.0


def tool_frame(sample: Sample) -> NDArray[np.float64]:
    """Return ``world_from_instrument`` of a sample, 4x4, its roll included."""
    return tip_frame(
        sample.instrument_tip_mm,
        sample.instrument_pointing,
        sample.instrument.roll_deg,
    )
