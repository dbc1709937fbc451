"""A recording as input, at the speed it was made at: a session or a probe path."""

from collections.abc import Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from devices import Pose, ProbePath, Registration, load_probe_path
from devices.recording.player import RecordedArm
from paravol.inputs.flight_input import FlightInput, in_the_patient
from paravol.inputs.pose_completer import path_instrument
from paravol.patient import PatientScene
from scenarios import Sample, tip_frame
from scenarios.bundle import Record, SampleRecord, SessionInfo, read_session
from scenarios.instrument_state import EMPTY_HAND
from system import UserError


@dataclass(slots=True)
class RecordedSamples:
    """Return the recorded sample that a played pose belongs to, bit by bit."""

    by_time: dict[float, Sample]

    def complete(self, pose: Pose) -> Sample:
        """Look the sample up by its time."""
        return self.by_time[pose.time_s]


class RecordingInput(FlightInput):
    """Play a session's folder NAME.paravol, or a probe path's file."""

    def __init__(self, file: Path) -> None:
        """Read it; UserError, in one sentence, when it cannot be played."""
        self.name = f"recording {file.name}"
        self._surface_sha256: str | None = None
        if file.is_dir():
            samples = self._read_bundle(file)
        else:
            samples = recorded_samples(file)
            self.registration = in_the_patient()
            self.has_instrument = True
        poses = [_pose_of(sample) for sample in samples]
        # Refused now, while nothing slow has begun.
        RecordedArm(poses, name=str(file)).close()
        self._file = file
        self._poses = poses
        self.completer = RecordedSamples({sample.time_s: sample for sample in samples})
        self.until_s = samples[-1].time_s

    def open(self, patient: PatientScene) -> AbstractContextManager[RecordedArm]:
        """Begin to play; UserError when it was flown through another head."""
        if self._surface_sha256 not in (None, patient.surface_sha256):
            raise UserError(
                f"{self._file} was flown through another head than this scenario's; "
                "choose the scenario it was recorded with."
            )
        return RecordedArm(self._poses, name=str(self._file))

    def _read_bundle(self, folder: Path) -> list[Sample]:
        info, records, _ = read_session(folder)
        self._surface_sha256 = info.surface_sha256
        self.has_instrument = info.has_instrument
        self.registration = Registration(
            np.array(info.world_from_device).reshape(4, 4),
            info.registration_rms_mm,
            np.zeros(0),
        )
        return _samples_in(info, records)


def recorded_samples(file: Path) -> list[Sample]:
    """Return the samples of a session's folder or of a probe path's file, in order.

    Raises UserError when it is neither.
    """
    if not file.is_dir():
        return _samples_of(load_probe_path(file))
    info, records, _ = read_session(file)
    return _samples_in(info, records)


def _samples_in(info: SessionInfo, records: Iterable[Record]) -> list[Sample]:
    samples = [r.sample() for r in records if isinstance(r, SampleRecord)]
    if not (info.has_instrument or info.operated):
        samples = [replace(sample, instrument=EMPTY_HAND) for sample in samples]
    # Of several at the same time the first is kept.
    times = [None, *(sample.time_s for sample in samples)]
    return [s for s, last in zip(samples, times, strict=False) if s.time_s != last]


def _samples_of(path: ProbePath) -> list[Sample]:
    return [
        Sample(
            state.t_s,
            tip_frame(path.tip_mm[i], path.axis[i]),
            float(path.roll_deg[i]),
            path.instrument_tip_mm[i],
            path.instrument_axis[i],
            int(path.buttons[i]),
            path_instrument(state),
            scope_deg=state.scope_deg,
        )
        for i, state in enumerate(map(path.sample, path.t_s.tolist()))
    ]


def _pose_of(sample: Sample) -> Pose:
    return Pose(sample.time_s, 0.0, sample.device_from_tip, sample.buttons)
