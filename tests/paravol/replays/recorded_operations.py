"""Recorded operations of a few seconds in which all happens that a picture shows."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paravol.patient import PatientScene
from scenarios import Sample, load_scenario, tip_frame
from scenarios.bundle import EditRecord, FrameRecord, SampleRecord, SessionRecorder
from scenarios.instrument_state import NO_TOOL, InstrumentState
from tests.paravol.replays.flown_session import parts_of

EVERY_S = 0.05
COUNT = 120
SIZES = 32, 48, 40
"""Edges of the pictures, in turn: a flight draws fewer pixels where it is late."""

WAY = np.array([1.0, 0.2, 0.1])

SampleAt = Callable[[int, NDArray[np.float64]], Sample]


def shaving(number: int, centre: NDArray[np.float64]) -> Sample:
    """Shave to and fro, undo now and then, rest, wash the lens, stand still."""
    along = 3.0 * np.sin(number / 11.0)
    at = centre + WAY * along + [0.0, 0.03 * number - 1.8, 0.0]
    tool = InstrumentState(
        "microdebrider",
        is_working=number % 13 < 9,
        is_sucking=number % 31 < 25,
        undone=number // 40,
        washed=number // 70,
    )
    is_frozen = 80 <= number < 86
    pose = tip_frame(at - 3 * WAY, WAY)
    return Sample(EVERY_S * number, pose, 0.0, at, WAY, 0, tool, is_frozen)


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


OPERATIONS: dict[str, SampleAt] = {"shaving": shaving, "changing": changing}


def record_operation(folder: Path, patient: PatientScene, sample_at: SampleAt) -> Path:
    """Record one as a flight does, a frame after every third sample."""
    scenario, _ = load_scenario("first_flight")
    centre = patient.scene.volume.center_mm
    edge = SIZES[0]
    info, session, operation, view = parts_of(scenario, patient, edge)
    with SessionRecorder(folder, info) as recorder:
        for place in range(COUNT):
            sample = sample_at(place, centre)
            session.step(sample)
            recorder.add(SampleRecord.of(sample))
            for edit in operation.take_edits():
                recorder.add(EditRecord.of(edit))
            if place % 3:
                continue
            view.apply(operation.take_changes())
            assert operation.lens is not None
            view.lens = operation.lens.state
            number = place // 3
            edge = SIZES[number // 7 % len(SIZES)]
            seen = session.view(sample, (edge, edge))
            frame = view.draw(seen, number=number, elapsed_s=3 * EVERY_S)
            size = 0 if edge == SIZES[0] else edge
            gap, print_ = seen.clearance_mm, frame.fingerprint()
            recorder.add(FrameRecord(number, place, frame.gain, gap, print_, size=size))
        recorder.close({"score": asdict(session.score())})
    return folder
