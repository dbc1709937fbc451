"""Short recorded operations, made without any device."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from devices import load_probe_path
from paravol.inputs.flight_input import in_the_patient
from paravol.patient import PatientScene
from paravol.session_setup import (
    build_session,
    build_view,
    describe_session,
    operate_on,
)
from paravol.view import EndoscopeView
from scenarios import Sample, Scenario, Session, load_scenario, tip_frame
from scenarios.bundle import (
    EventRecord,
    FrameRecord,
    SampleRecord,
    SessionInfo,
    SessionRecorder,
)
from scenarios.instrument_state import InstrumentState
from scenarios.operation import Operation

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


class Parts(NamedTuple):
    """Hold what records a flight: what it says of itself, and what steps and draws."""

    info: SessionInfo
    session: Session
    operation: Operation
    view: EndoscopeView


def parts_of(scenario: Scenario, patient: PatientScene, size: int) -> Parts:
    """Prepare an operation in a patient that is recorded; size: of its pictures, px."""
    info = describe_session(
        scenario, patient, in_the_patient(), size=size, has_instrument=True
    )
    operated, operation = operate_on(patient)
    session = build_session(scenario, operated, np.eye(4), (size, size), operation)
    view = build_view(
        scenario,
        operated,
        tier=info.tier,
        seed=info.seed,
        has_instrument=True,
        threads=1,
    )
    return Parts(info, session, operation, view)


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
    info, session, operation, view = parts_of(scenario, patient, size)
    count = round(LASTS_S / speed / EVERY_S)
    with SessionRecorder(folder, info) as recorder:
        for n in range(count + 1):
            share = n / count
            tip, axis, tool_tip, tool_axis = poses(share)
            is_cutting = share >= CHANGED_SHARE
            tool = InstrumentState(
                "microdebrider" if is_cutting else "suction tube",
                is_working=is_cutting,
                is_sucking=True,
            )
            time_s = round(n * EVERY_S, 6)
            pose = tip_frame(tip, axis)
            sample = Sample(time_s, pose, 0.0, tool_tip, tool_axis, 0, tool)
            session.step(sample)
            recorder.add(SampleRecord.of(sample))
            if n % SHOWN_EVERY:
                continue
            view.apply(operation.take_changes())
            assert operation.lens is not None
            view.lens = operation.lens.state
            number = n // SHOWN_EVERY
            # a flight draws fewer pixels where it is late
            edge = size if number % 3 else size * 3 // 4
            seen = session.view(sample, (edge, edge))
            frame = view.draw(seen, number=number, elapsed_s=EVERY_S)
            gap, print_ = seen.clearance_mm, frame.fingerprint()
            told = 0 if edge == size else edge
            recorder.add(FrameRecord(number, n, frame.gain, gap, print_, size=told))
        recorder.add(EventRecord(0.5, "snapshot", "frame 2"))
        recorder.close({"score": asdict(session.score())})
    return folder
