"""A short recorded flight through a coarse head, made without any device."""

from pathlib import Path

import numpy as np

from devices import load_probe_path
from paravol.inputs.flight_input import in_the_patient
from paravol.patient import PatientScene
from paravol.session_setup import (
    build_session,
    build_view,
    describe_session,
    operate_on,
)
from scenarios import Sample, Scenario, load_scenario, tip_frame
from scenarios.bundle import (
    EventRecord,
    FrameRecord,
    SampleRecord,
    SessionRecorder,
    write_json,
)
from scenarios.instrument_state import InstrumentState

EVERY_S = 0.04
LASTS_S = 2.0
SHOWN_EVERY = 5
"""Each so many-th sample is shown by a frame."""

CHANGED_S = 1.0
"""When the tool is changed."""


def record_flight(
    folder: Path,
    scenario_file: Path,
    patient: PatientScene,
    *,
    begin_s: float = 8.0,
    speed: float = 1.0,
    size: int = 64,
) -> Scenario:
    """Record what flying a part of the scenario's path shows, frame by frame.

    begin_s: of the path. speed: seconds of the path in one of the session.
    """
    scenario, place = load_scenario(str(scenario_file))
    path = load_probe_path(place / scenario.path)
    info = describe_session(
        scenario, patient, in_the_patient(), size=size, has_instrument=True
    )
    operated, operation = operate_on(patient)
    session = build_session(scenario, operated, np.eye(4), (size, size), operation)
    view = build_view(
        scenario, operated, tier=info.tier, seed=info.seed, has_instrument=True,
        threads=1,
    )
    with SessionRecorder(folder, info) as recorder:
        for n in range(round(LASTS_S / speed / EVERY_S) + 1):
            time_s = round(n * EVERY_S, 6)
            at = path.sample(begin_s + speed * time_s)
            name = "suction tube" if time_s * speed < CHANGED_S else "microdebrider"
            sample = Sample(
                time_s,
                tip_frame(at.tip_mm, at.axis),
                at.roll_deg,
                at.instrument_tip_mm,
                at.instrument_axis,
                at.buttons,
                InstrumentState(
                    name, is_working=name == "microdebrider", is_sucking=True
                ),
            )
            session.step(sample)
            recorder.add(SampleRecord.of(sample))
            if n % SHOWN_EVERY:
                continue
            view.apply(operation.take_changes())
            assert operation.lens is not None
            view.lens = operation.lens.state
            seen = session.view(sample)
            number = n // SHOWN_EVERY
            frame = view.draw(seen, number=number, elapsed_s=EVERY_S)
            recorder.add(
                FrameRecord(
                    number, n, frame.gain, seen.clearance_mm, frame.fingerprint()
                )
            )
        recorder.add(EventRecord(0.5, "snapshot", "frame 2"))
        recorder.close({})
    return scenario
