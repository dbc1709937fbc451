"""What is to be flown in a window, and what the window shows of it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices import ProbePath
from paravol.inputs import FlightInput
from paravol.kept_sessions import KeptSessions
from scenarios import Scenario, View


@dataclass(frozen=True, slots=True)
class FlightOrder:
    """Say what is to be flown.

    record: folder of the recording, None where nobody named one.
    stream: host and port at which tool poses are streamed, None for nowhere.
    kept: where a flight is recorded that nobody named a folder for, None for nowhere.
    """

    scenario: Scenario
    path: ProbePath
    input: FlightInput
    size: int
    threads: int
    record: Path | None
    stream: tuple[str, int] | None = None
    kept: KeptSessions | None = None


@dataclass(frozen=True, slots=True)
class Instant:
    """Hold what the window shows of one frame; pixels ``(h, w, 3)`` uint8 sRGB."""

    pixels: NDArray[np.uint8]
    view: View
    time_s: float
    pose_age_ms: float
    fps: float
