"""Recorded operations of a few seconds in which all happens that a picture shows."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paravol.patient import PatientScene
from scenarios import Sample, load_scenario, tip_frame
from scenarios.instrument_state import NO_TOOL, InstrumentState
from tests.recorded_flight import WAY, Flight, shaving

EVERY_S = 0.05
COUNT = 120
SIZES = 32, 48, 40
"""Edges of the pictures, in turn: a flight draws fewer pixels where it is late."""

SampleAt = Callable[[int, NDArray[np.float64]], Sample]


def resting(number: int, centre: NDArray[np.float64]) -> Sample:
    """Shave to and fro, undo now and then, rest, wash the lens, stand still."""
    undone, washed = number // 40, number // 70
    centre = centre + np.array([0.0, 0.01 * number - 0.3, 0.0])
    is_frozen = 80 <= number < 86
    return shaving(number, centre, is_frozen=is_frozen, undone=undone, washed=washed)


def changing(number: int, centre: NDArray[np.float64]) -> Sample:
    """Bite, inject, press tissue aside and let it spring back, with three scopes."""
    part, step = divmod(number, COUNT // 6)
    names = (
        "straight forceps",
        "injection needle",
        "elevator",
        NO_TOOL,
        "curette",
        "suction tube",
    )
    at = centre + WAY * (0.25 * step - 2.0) + [0.0, 0.4 * part - 1.0, 0.2 * part]
    tool = InstrumentState(
        names[part],
        roll_deg=15.0 * part,
        jaw=(step % 5) / 4.0,
        is_working=step % 7 < 5,
        is_sucking=True,
    )
    pose = tip_frame(at - (2.0 + 0.1 * part) * WAY, WAY)
    angle = (None, 30.0, 45.0)[part // 2]
    return Sample(
        EVERY_S * number, pose, 3.0 * step, at, WAY, 0, tool, False, angle, 10.0 * part
    )


OPERATIONS: dict[str, SampleAt] = {"shaving": resting, "changing": changing}


def record_operation(folder: Path, patient: PatientScene, sample_at: SampleAt) -> Path:
    """Record one as a flight does, a frame after every third sample."""
    scenario, _ = load_scenario("first_flight")
    centre = patient.scene.volume.center_mm
    flight = Flight(scenario, patient, size=SIZES[0])
    with flight.recorded(folder):
        for place in range(COUNT):
            flight.step(sample_at(place, centre))
            if place % 3 == 0:
                flight.show(SIZES[place // 21 % len(SIZES)], 3 * EVERY_S)
    return folder
