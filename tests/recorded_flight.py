"""Flights recorded as the product records them, without a device or a window."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from paravol.inputs.flight_input import in_the_patient
from paravol.patient import PatientScene
from paravol.sessions.session_setup import (
    build_session,
    build_view,
    describe_session,
    operate_on,
)
from paravol.view import EndoscopeView, Frame
from scenarios import Sample, Scenario, Score, Session, load_scenario, tip_frame
from scenarios.bundle import (
    EditRecord,
    EventRecord,
    FrameRecord,
    PatientRecord,
    Record,
    SampleRecord,
    SessionInfo,
    SessionRecorder,
)
from scenarios.instrument_state import InstrumentState
from scenarios.operation import Operation
from tests.paravol.operated_head import head_round_an_orbit

WAY = np.array([1.0, 0.2, 0.1])
"""How the tool of `shaving` points, and the scope behind it."""


class Flight:
    """Steps and records samples, and draws the frames that are asked for.

    operation: what edits the patient; None where nobody operates.
    """

    def __init__(
        self,
        scenario: Scenario,
        patient: PatientScene,
        *,
        size: int = 32,
        operates: bool = True,
        **told: Any,
    ) -> None:
        """Prepare a session; size: of its pictures, px. told: changes of its info."""
        self.scenario, self._size = scenario, size
        info = info_of(scenario, patient, size=size, operates=operates)
        self.info = msgspec.structs.replace(info, **told)
        self.patient = patient
        self.operation: Operation | None = None
        if operates:
            self.patient, self.operation = operate_on(patient)
        self.session: Session = build_session(
            scenario, self.patient, np.eye(4), (size, size), self.operation
        )
        self._frames = 0

    @cached_property
    def view(self) -> EndoscopeView:
        """What draws its frames."""
        return build_view(
            self.scenario,
            self.patient,
            tier=self.info.tier,
            seed=self.info.seed,
            threads=1,
        )

    @contextmanager
    def recorded(self, folder: Path, has_end: bool = True) -> Iterator[SessionRecorder]:
        """Record what is flown meanwhile; without an end, as if it was killed."""
        with SessionRecorder(folder, self.info) as self._recorder:
            yield self._recorder
            if has_end:
                self._end()

    def step(self, sample: Sample) -> None:
        """Fly a sample, and record what came of it."""
        self._sample = sample
        self.session.step(sample)
        self._recorder.add(SampleRecord.of(sample, self.session.reading))
        if self.operation is None:
            return
        for edit in self.operation.take_edits():
            self._recorder.add(EditRecord.of(edit))
        for injury in self.operation.take_injuries():
            event = EventRecord(injury.time_s, "injury", injury.structure)
            self._recorder.add(event)

    def show(self, edge: int, elapsed_s: float, gain: float | None = None) -> Frame:
        """Draw the newest sample in so many pixels, and record its frame."""
        if self.operation is not None:
            self.view.apply(self.operation.take_changes())
            assert self.operation.lens is not None
            self.view.lens = self.operation.lens.state
        seen = self.session.view(self._sample, (edge, edge))
        number = self._frames
        frame = self.view.draw(seen, number=number, elapsed_s=elapsed_s, gain=gain)
        gap, print_ = seen.clearance_mm, frame.fingerprint()
        place = self._recorder.samples - 1
        size = 0 if edge == self._size else edge
        record = FrameRecord(number, place, frame.gain, gap, print_, size=size)
        self._recorder.add(record)
        self._frames += 1
        return frame

    def _end(self) -> None:
        if self.operation is not None:
            kept = self.operation.patient
            record = PatientRecord(self._sample.time_s, kept.generation, kept.hash())
            self._recorder.add(record)
        score = asdict(self.session.score())
        self._recorder.close({"score": score, "timing": {}})


def info_of(
    scenario: Scenario, patient: PatientScene, *, size: int = 32, operates: bool = True
) -> SessionInfo:
    """Return what a recording says of a session."""
    registration = in_the_patient()
    info = describe_session(
        scenario, patient, registration, size=size, has_instrument=operates
    )
    return msgspec.structs.replace(info, operated=operates)


@dataclass(frozen=True)
class Recorded:
    """A recorded flight, the patient as before it, and what the session told of it."""

    folder: Path
    patient: PatientScene
    score: Score


def record(
    folder: Path,
    scenario: Scenario,
    patient: PatientScene,
    samples: Iterable[Sample],
    **options: Any,
) -> Recorded:
    """Record a flight of these samples; options: as of `Flight`."""
    flight = Flight(scenario, patient, **options)
    with flight.recorded(folder):
        for sample in samples:
            flight.step(sample)
    return Recorded(folder, patient, flight.session.score())


def write_records(folder: Path, info: SessionInfo, records: Iterable[Record]) -> Path:
    """Write a stream of these records, which nobody has flown; return its folder."""
    with SessionRecorder(folder, info) as recorder:
        for each in records:
            recorder.add(each)
        recorder.close({})
    return folder


def shaving(
    number: int,
    centre: NDArray[np.float64],
    *,
    every_s: float = 0.05,
    is_frozen: bool = False,
    **hand: Any,
) -> Sample:
    """Shave to and fro round a place; hand: what else is so of the tool."""
    along = 3.0 * np.sin(number / 11.0)
    at = centre + WAY * along + [0.0, 0.02 * number - 1.5, 0.0]
    tool = InstrumentState(
        "microdebrider",
        is_working=number % 13 < 9,
        is_sucking=number % 31 < 25,
        **hand,
    )
    frame = tip_frame(at - 3 * WAY, WAY)
    return Sample(every_s * number, frame, 0.0, at, WAY, 0, tool, is_frozen)


def shaved(folder: Path) -> Recorded:
    """Record an operation before an orbit: strokes taken back, a while frozen."""
    scenario, _ = load_scenario("first_flight")
    patient = head_round_an_orbit(scenario)
    centre = patient.scene.volume.center_mm
    samples = (
        shaving(n, centre, undone=n // 30, is_frozen=44 <= n < 50) for n in range(80)
    )
    return record(folder, scenario, patient, samples)
