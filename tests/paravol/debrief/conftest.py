"""A short recorded operation on a small head, and its debrief without pictures."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import pytest

from paravol.debrief import DebriefOrder, write_debrief
from paravol.patient import PatientScene
from scenarios import load_scenario
from scenarios.tasks.task import Remove
from tests.paravol.operated_head import head_round_an_orbit
from tests.recorded_flight import record, shaving

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
    samples = [
        shaving(n, centre, every_s=EVERY_S, is_frozen=n in FROZEN) for n in range(COUNT)
    ]
    record(folder, scenario, patient, samples)
    out = folder.with_name("debrief.html")
    write_debrief(DebriefOrder(folder, out, quality=None), patient=patient)
    return Recorded(folder, patient, out.read_text("utf-8"))
