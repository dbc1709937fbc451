"""Flights that end as people's do: nothing done, one task of many, somebody hurt."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import msgspec
import numpy as np
from PySide6.QtWidgets import QApplication, QLabel

from app.window.result.result_page import ResultPage
from paravol.exercises.scripted_hand import ScriptedHand
from paravol.flight.flight_events import FlightEnd
from paravol.patient import PatientScene, load_patient, no_progress
from paravol.trainee.session_result import (
    ResultOrder,
    SessionResult,
    result_of_session,
)
from scenarios import Sample, Scenario, load_scenario, tip_frame
from scenarios.instrument_state import InstrumentState
from scenarios.tasks.task import KeepAway, Limits, Remove
from tests.paravol.operated_head import head_round_an_orbit
from tests.recorded_flight import record


class FlownEnd:
    """A recorded flight and what the window makes of it."""

    def __init__(
        self,
        folder: Path,
        scenario: Scenario,
        patient: PatientScene,
        samples: list[Sample],
    ) -> None:
        self.scenario, self.patient, self.folder = scenario, patient, folder
        flown = record(folder, scenario, patient, samples)
        self.end = FlightEnd("The flight is over", flown.score, folder, True)

    @cached_property
    def result(self) -> SessionResult:
        """Score it as the window does."""
        order = ResultOrder(self.folder, has_store=False, patient=self.patient)
        return result_of_session(order)

    def page(self) -> ResultPage:
        """Return the page that the user sees, scored."""
        page = ResultPage(self.scenario, self.end)
        page.set_scale(1.0)
        page.resize(1280, 720)
        page.show()
        page.show_result(self.result)
        QApplication.processEvents()
        return page


def told(page: ResultPage) -> list[str]:
    """Return every text of a page, from the top."""
    labels = page.findChildren(QLabel)
    return [label.text() for label in labels if label.isVisibleTo(page)]


def scripted(
    name: str, does: Callable[[ScriptedHand], object]
) -> tuple[Scenario, PatientScene, list[Sample]]:
    """Return an exercise, its head, and what a scripted hand does in it."""
    scenario, _ = load_scenario(name)
    patient = load_patient(scenario, no_progress)
    hand = ScriptedHand(scenario, patient, operates=bool(scenario.tools))
    does(hand)
    return scenario, patient, hand.samples


def only_first(hand: ScriptedHand) -> None:
    """Do the first task, then end the flight."""
    hand.stay(0.2)
    hand.do(hand.scenario.tasks[0])
    hand.stay(0.2)


def shaving(hurts: bool) -> tuple[Scenario, PatientScene, list[Sample]]:
    """Shave to and fro in an orbit, or beside it, where an exercise asks for it."""
    scenario, _ = load_scenario("first_flight")
    tissues = {"mucosa": Limits(least_mm3=1.0)}
    scenario = msgspec.structs.replace(
        scenario,
        title="Shave, and leave the orbit whole",
        tools=("microdebrider",),
        marks=msgspec.structs.replace(scenario.marks, metrics=()),
        tasks=(
            Remove(name="take", title="Take some tissue", tissues=tissues),
            KeepAway(
                name="safe",
                title="Keep away from the orbit",
                hazards=("orbit",),
                margin_mm=1.0,
                most_dose_s=9.0,
            ),
        ),
    )
    patient = head_round_an_orbit(scenario)
    way = np.array([1.0, 0.2, 0.1])
    middle = patient.scene.volume.center_mm + (0.0 if hurts else 8.0) * way
    samples = []
    for n in range(80):
        at = middle + way * 3.0 * np.sin(n / 11.0) + [0.0, 0.02 * n - 1.5, 0.0]
        state = InstrumentState("microdebrider", is_working=n % 13 < 9, is_sucking=True)
        frame = tip_frame(at - 30 * way, way)
        samples.append(Sample(0.05 * n, frame, 0.0, at, way, 0, state))
    return scenario, patient, samples
