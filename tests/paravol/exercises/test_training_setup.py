"""What all flights of a training have in common reaches each of them."""

from dataclasses import replace
from pathlib import Path

from paravol.exercises.training_setup import DeviceSetup, TrainingSetup
from paravol.flight.flight_events import FlightEvent, Hear
from paravol.sessions.session_store import SessionStore
from scenarios import Scenario, load_scenario


def test_each_order_has_a_watcher_of_its_own() -> None:
    asked: list[str] = []

    def watcher(scenario: Scenario) -> Hear:
        asked.append(scenario.name)
        heard: list[FlightEvent] = []
        return heard.append

    setup = TrainingSetup(devices=DeviceSetup(), size=64, threads=1, watcher=watcher)
    first, second = setup.order("hoops"), setup.order("centring")
    assert asked == ["hoops", "centring"]
    assert len(first.watchers) == len(second.watchers) == 1
    assert first.watchers != second.watchers
    alone = TrainingSetup(devices=DeviceSetup(), size=64, threads=1)
    assert alone.order("hoops").watchers == ()


def test_each_order_records_where_the_training_looks_for_sessions(
    tmp_path: Path,
) -> None:
    kept = SessionStore(tmp_path / "here")
    setup = TrainingSetup(devices=DeviceSetup(), size=64, threads=1, sessions=kept)
    assert setup.order("hoops").kept == kept


def test_attempts_are_at_one_patient_after_another() -> None:
    setup = TrainingSetup(devices=DeviceSetup(), size=64, threads=1)
    patients = load_scenario("uncinectomy")[0].head.patients
    assert len(set(patients)) == len(patients) > 5
    asked: list[str] = []

    def attempts(exercise: str) -> int:
        asked.append(exercise)
        return len(asked) - 1

    for number in (*patients, patients[0]):
        head = setup.order("uncinectomy", attempts).scenario.head
        assert head.number == number
    assert set(asked) == {"uncinectomy"}
    examined = replace(setup, patient=77)
    for _ in range(2):
        assert examined.order("uncinectomy", attempts).scenario.head.number == 77
    assert len(asked) == len(patients) + 1
    # a recorded path leads through its own head alone
    assert not examined.order("first_flight").scenario.head.patients
