"""A short recorded operation on a small head, and its debrief without pictures."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from paravol.debrief import DebriefOrder, write_debrief
from paravol.inputs.flight_input import in_the_patient
from paravol.patient import PatientScene
from paravol.session_setup import build_session, describe_session, operate_on
from scenarios import Sample, load_scenario, tip_frame
from scenarios.bundle import SampleRecord, SessionRecorder
from scenarios.instrument_state import InstrumentState
from scenarios.tasks.task import Remove
from tests.paravol.operated_head import head_round_an_orbit

HOSTILE = "<script>alert(1)</script> & \"quotes' {{ 7 * 7 }}"
EVERY_S, COUNT, FROZEN = 0.05, 80, range(60, 70)


@dataclass(frozen=True)
class Recorded:
    """A recorded operation, its patient as before it, and its page's text."""

    folder: Path
    patient: PatientScene
    text: str

    def written(self, out: Path, **options: Any) -> str:
        """Return the page that these options give."""
        order = replace(DebriefOrder(self.folder, out, quality=None), **options)
        write_debrief(order, patient=self.patient)
        return out.read_text("utf-8")


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """Record a microdebrider that goes to and fro in front of an orbit."""
    folder = tmp_path_factory.mktemp("recorded") / "flight.paravol"
    scenario, _ = load_scenario("first_flight")
    task = Remove(name="take", title=HOSTILE, hint=HOSTILE)
    scenario = msgspec.structs.replace(scenario, title=HOSTILE, tasks=(task,))
    patient = head_round_an_orbit(scenario)
    centre = patient.scene.volume.center_mm
    info = describe_session(
        scenario, patient, in_the_patient(), size=32, has_instrument=True
    )
    operated, operation = operate_on(patient)
    session = build_session(scenario, operated, np.eye(4), (32, 32), operation)
    way = np.array([1.0, 0.2, 0.1])
    with SessionRecorder(folder, info) as recorder:
        for n in range(COUNT):
            at = centre + 3.0 * np.sin(n / 11.0) * way + [0.0, 0.02 * n - 1.5, 0.0]
            state = InstrumentState(
                "microdebrider", is_working=n % 13 < 9, is_sucking=n % 31 < 25
            )
            frame = tip_frame(at - 3 * way, way)
            sample = Sample(EVERY_S * n, frame, 0.0, at, way, 0, state, n in FROZEN)
            session.step(sample)
            recorder.add(SampleRecord.of(sample))
        recorder.close({"score": asdict(session.score())})
    out = folder.with_name("debrief.html")
    write_debrief(DebriefOrder(folder, out, quality=None), patient=patient)
    return Recorded(folder, patient, out.read_text("utf-8"))
