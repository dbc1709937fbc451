"""How fast recorded sessions are scored: by their recording, or stepped again."""

import tempfile
from dataclasses import asdict
from functools import cached_property, partial
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.nasal_views import bundled_flight
from benchmarks.plan import Measured, Plan, Task
from benchmarks.timing import measure
from devices import Registration
from paravol.patient import PatientScene, load_patient, no_progress
from paravol.scoring.session_scoring import score_session
from paravol.sessions.session_setup import build_session, describe_session
from scenarios import Sample, tip_frame
from scenarios.bundle import FrameRecord, SampleRecord, SessionRecorder
from scenarios.rubrics import load_rubric

RATE_HZ = 100.0
ARM_MM = 0.05
FRAME_EVERY = 4
"""Samples between two pictures of a live flight."""

STEPPED = "stepped again"
MODES = STEPPED, "recording trusted"


class ScoringPlan(Plan, suite="scoring"):
    """List and make the measurements of suite `scoring`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._seconds = 60.0 if quick else 600.0
        scratch = tempfile.TemporaryDirectory(prefix="paravol-scoring-")
        self._folder = Path(self.stack.enter_context(scratch))
        self._rubric = load_rubric("endoscopy")

    def tasks(self) -> list[Task]:
        """List the tasks; what is trusted is compared with what is stepped."""
        case = f"session of {self._seconds:g} s"
        cost_s = self._seconds / 4.0
        return self.compared(
            case,
            {mode: partial(self._score, exact=mode == STEPPED) for mode in MODES},
            {"rate_hz": RATE_HZ, "rubric": self._rubric.name},
            cost_s=cost_s,
        )

    @cached_property
    def _patient(self) -> PatientScene:
        return load_patient(bundled_flight()[0], no_progress)

    @cached_property
    def _session(self) -> Path:
        """Record the bundled flight, to and fro, with the noise of an arm."""
        folder = self._folder / "long.paravol"
        scenario, path = bundled_flight()
        registration = Registration(np.eye(4), 0.2, np.zeros(0))
        info = describe_session(
            scenario, self._patient, registration, size=64, has_instrument=False
        )
        info = msgspec.structs.replace(info, operated=False)
        session = build_session(scenario, self._patient, np.eye(4), (64, 64))
        rng = np.random.default_rng(1)
        with SessionRecorder(folder, info) as recorder:
            for number in range(round(self._seconds * RATE_HZ)):
                time_s = number / RATE_HZ
                turns, at_s = divmod(time_s, path.duration_s)
                on = path.sample(at_s if turns % 2 == 0 else path.duration_s - at_s)
                frame = tip_frame(on.tip_mm, on.axis)
                frame[:3, 3] += ARM_MM * rng.standard_normal(3)
                tool_mm = on.instrument_tip_mm + ARM_MM * rng.standard_normal(3)
                sample = Sample(
                    time_s, frame, on.roll_deg, tool_mm, on.instrument_axis, 0
                )
                session.step(sample)
                recorder.add(SampleRecord.of(sample))
                if number % FRAME_EVERY == 0:
                    shown = number // FRAME_EVERY
                    recorder.add(
                        FrameRecord(
                            shown, number, 1.0, session.view(sample).clearance_mm
                        )
                    )
            recorder.close({"score": asdict(session.score())})
        return folder

    def _score(self, *, exact: bool) -> Measured:
        """Time one session; its head is loaded, as for all but the first of many."""
        folder, patient = self._session, self._patient

        def score() -> float:
            found, metrics = score_session(
                folder, self._rubric, patient=patient, exact=exact
            )
            assert metrics.source.startswith("stepped") == exact
            return found.percent or 0.0

        timing, percent = measure(score, least=1 if exact else 3, warm_up=not exact)
        return Measured(
            timing,
            counters={
                "times_real_time": self._seconds / timing.cpu_s,
                "percent": percent,
            },
        )
