"""Short recorded operations, made without any device."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices import load_probe_path
from paravol.patient import PatientScene
from scenarios import Sample, Scenario, load_scenario, tip_frame
from scenarios.bundle import EventRecord
from scenarios.instrument_state import InstrumentState
from tests.recorded_flight import Flight

EVERY_S = 0.04
LASTS_S = 2.0
SHOWN_EVERY = 5
"""Each so many-th sample is shown by a frame."""

CHANGED_SHARE = 0.5
"""When the tool is changed."""

Doubles = NDArray[np.float64]
Poses = Callable[[float], tuple[Doubles, Doubles, Doubles, Doubles]]
"""Tip and direction of the scope and of the tool, by the share of the way."""


def along_the_path(scenario_file: Path, begin_s: float = 8.0) -> Poses:
    """Two seconds of a scenario's own path."""
    scenario, place = load_scenario(str(scenario_file))
    path = load_probe_path(place / scenario.path)

    def poses(share: float) -> tuple[Doubles, Doubles, Doubles, Doubles]:
        at = path.sample(begin_s + LASTS_S * share)
        return at.tip_mm, at.axis, at.instrument_tip_mm, at.instrument_axis

    return poses


def record_flight(
    folder: Path,
    scenario: Scenario,
    patient: PatientScene,
    poses: Poses,
    *,
    speed: float = 1.0,
    size: int = 64,
) -> Path:
    """Record a flight, with every fifth sample's frame, and return its folder.

    The tool is changed in the middle and cuts from then on. speed: as a factor.
    """
    flight = Flight(scenario, patient, size=size)
    count = round(LASTS_S / speed / EVERY_S)
    with flight.recorded(folder) as recorder:
        for n in range(count + 1):
            share = n / count
            tip, axis, tool_tip, tool_axis = poses(share)
            is_cutting = share >= CHANGED_SHARE
            tool = InstrumentState(
                "microdebrider" if is_cutting else "suction tube",
                is_working=is_cutting,
                is_sucking=True,
            )
            time_s, pose = round(n * EVERY_S, 6), tip_frame(tip, axis)
            flight.step(Sample(time_s, pose, 0.0, tool_tip, tool_axis, 0, tool))
            if n % SHOWN_EVERY == 0:
                # a flight draws fewer pixels where it is late
                flight.show(size if n // SHOWN_EVERY % 3 else size * 3 // 4, EVERY_S)
        recorder.add(EventRecord(0.5, "snapshot", "frame 2"))
    return folder
