"""Frames as a flight tells them, without a flight."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paravol.flight.flight_loop import FrameEvent
from scenarios import Sample, tip_frame
from scenarios.instrument_state import InstrumentState
from scenarios.tasks import Status, TaskState


def frame(
    number: int, pixels: NDArray[np.uint8] | None = None, **more: Any
) -> FrameEvent:
    """What a flight tells of a frame; only what is read of it is there."""
    if pixels is None:
        pixels = np.full((32, 32, 3), number % 256, np.uint8)
    pose = tip_frame(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    hand = InstrumentState("microdebrider", is_working=True, is_sucking=True)
    still = np.zeros(3)
    sample = Sample(0.1 * number, pose, 0.0, still, still, 0, hand)
    # looking backwards, with the patient's head upright
    axes = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], np.float64)
    view = SimpleNamespace(
        camera=SimpleNamespace(frame=axes),
        world_from_tip=pose,
        world_from_instrument=pose,
        clearance_mm=1.25,
        touched="",
    )
    told: dict[str, Any] = {
        "frame": SimpleNamespace(pixels=pixels),
        "view": view,
        "sample": sample,
        "number": number,
        "pose_age_ms": 12.0,
        "cuts": 3,
        "clock_s": 0.1 * number,
        "tasks": (TaskState("middle turbinate", Status.OPEN, 0.5),),
    }
    return FrameEvent(**(told | more))


class Hazards:
    """Hazards at fixed distances."""

    def __init__(self, **gaps: float) -> None:
        self.gaps = gaps
        self.names = tuple(gaps)

    def along_mm(self, lines: Sequence[object]) -> list[dict[str, float]]:
        """Return the distances of each line."""
        return [dict(self.gaps) for _ in lines]
