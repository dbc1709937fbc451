"""A short recorded flight before the hoops, a scene that is built at once."""

from dataclasses import asdict
from functools import cache
from pathlib import Path

import msgspec
import numpy as np

from paravol.inputs.flight_input import in_the_patient
from paravol.patient import PatientScene, load_patient, no_progress
from paravol.session_setup import build_session, describe_session
from scenarios import Sample, Scenario, load_scenario, tip_frame
from scenarios.bundle import SampleRecord, SessionRecorder


@cache
def scene() -> tuple[Scenario, PatientScene]:
    scenario, _ = load_scenario("hoops")
    return scenario, load_patient(scenario, no_progress)


def record(
    folder: Path, *, created: str = "2026-03-01T10:00:00+00:00", has_end: bool = True
) -> Path:
    """Record two seconds straight in; without an end, as if the program was killed."""
    scenario, patient = scene()
    info = describe_session(
        scenario, patient, in_the_patient(), size=32, has_instrument=False
    )
    info = msgspec.structs.replace(
        info, created=created, automatic=True, operated=False
    )
    session = build_session(scenario, patient, np.eye(4), (32, 32))
    with SessionRecorder(folder, info) as recorder:
        for number in range(40):
            at = np.array([0.0, 0.2 * number, 0.0])
            axis = np.array([0.0, 1.0, 0.0])
            sample = Sample(0.05 * number, tip_frame(at, axis), 0.0, at, axis, 0)
            session.step(sample)
            recorder.add(SampleRecord.of(sample))
        if has_end:
            recorder.close({"score": asdict(session.score()), "timing": {}})
        else:
            recorder.flush()
    return folder
