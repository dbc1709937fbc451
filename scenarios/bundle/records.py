"""What a recorded session's stream holds: samples, frames and events."""

from collections.abc import Sequence

import msgspec
import numpy as np
from xxhash import xxh3_128_intdigest

from scenarios.instrument_state import AS_BEFORE, InstrumentState
from scenarios.reading import Reading
from scenarios.sample import Sample
from surgery.edit import Edit
from surgery.solids import SEED
from system import UserError

SEAL = "seal"
"""Kind of the event that holds `SessionInfo.seal`; readers keep it to themselves."""


class StreamHash:
    """Hash the records of a stream, in whatever order another tool wrote them anew."""

    def __init__(self) -> None:
        self._sum = 0

    def add(self, record: bytes) -> None:
        """Take in a record as it stands in the stream."""
        self._sum += xxh3_128_intdigest(record)

    def hexdigest(self) -> str:
        """Return the hash of all so far, 32 hexadecimal digits."""
        return f"{self._sum % (1 << 128):032x}"


class SampleRecord(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True
):
    """One measured sample; see `scenarios.sample.Sample`.

    A number that there is not, such as the place of a tool that was lost, is NaN in a
    sample and null in JSON. instrument: absent in recordings from before tools did
    anything. is_frozen: likewise from before the trainer could be frozen. scope_deg:
    absent for the exercise's scope. camera_roll_deg: absent where it is 0. reading:
    what was measured there; absent in older recordings.
    """

    time_s: float
    device_from_tip: Sequence[float | None]
    roll_deg: float
    instrument_tip_mm: Sequence[float | None]
    instrument_pointing: Sequence[float | None]
    buttons: int
    instrument: InstrumentState = AS_BEFORE
    is_frozen: bool = False
    scope_deg: float | None = None
    camera_roll_deg: float = 0.0
    reading: Reading | None = None

    @classmethod
    def of(cls, sample: Sample, reading: Reading | None = None) -> "SampleRecord":
        """Make the record of a sample. Floats keep all their bits."""
        return cls(
            sample.time_s,
            [float(v) for v in sample.device_from_tip.ravel()],
            sample.roll_deg,
            [float(v) for v in sample.instrument_tip_mm],
            [float(v) for v in sample.instrument_pointing],
            sample.buttons,
            sample.instrument,
            sample.is_frozen,
            scope_deg=sample.scope_deg,
            camera_roll_deg=sample.camera_roll_deg,
            reading=reading,
        )

    def sample(self) -> Sample:
        """Return the sample back, bit by bit."""
        if len(self.device_from_tip) != 16:
            raise UserError(
                f"a pose has 16 numbers, the record has {len(self.device_from_tip)}"
            )
        return Sample(
            self.time_s,
            np.array(self.device_from_tip, np.float64).reshape(4, 4),
            self.roll_deg,
            np.array(self.instrument_tip_mm, np.float64),
            np.array(self.instrument_pointing, np.float64),
            self.buttons,
            self.instrument,
            self.is_frozen,
            scope_deg=self.scope_deg,
            camera_roll_deg=self.camera_roll_deg,
        )


class FrameRecord(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True
):
    """One picture as it was shown.

    sample: index of the sample it shows, counted from 0 in this stream.
    gain: the camera's gain; stored because it depends on all frames before.
    xxh3_128: hash of the picture's bytes. blake2b: what stood there in recordings of
    looks before 3, whose pictures are not compared. size: edge of the square picture,
    pixels; 0, and absent, where it is that of the session.
    """

    number: int
    sample: int
    gain: float
    clearance_mm: float
    xxh3_128: str = ""
    blake2b: str = ""
    size: int = 0

    def size_of(self, session: tuple[int, int]) -> tuple[int, int]:
        """Return width and height of the picture; session: that of the session."""
        return (self.size, self.size) if self.size else session


class EventRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Something worth remembering: a snapshot request, a device error, the end."""

    time_s: float
    kind: str
    text: str


class EditRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What one cut took; edits follow from samples, so a replay can be checked.

    number, time_s, tool, taken_mm3, bone_mm3, pieces_mm3, counts: as in
    `surgery.edit.Edit`. solids: its rows of 16 numbers, one after the other.
    """

    number: int
    time_s: float
    tool: str
    counts: int
    taken_mm3: dict[str, float]
    bone_mm3: dict[str, float]
    pieces_mm3: float
    solids: list[float]

    @property
    def stroke(self) -> int:
        """Return the stroke it belongs to: its cuts are undone together."""
        return int(self.solids[SEED])

    @classmethod
    def of(cls, edit: Edit) -> "EditRecord":
        """Make the record of an edit."""
        return cls(
            edit.number,
            edit.time_s,
            edit.tool,
            edit.counts,
            edit.taken_mm3,
            edit.bone_mm3,
            edit.pieces_mm3,
            edit.solids.ravel().tolist(),
        )


class PatientRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The operated patient at one moment.

    xxh3_128: of distance and fill, see `surgery.patient.OperatedPatient.hash`.
    generation: changes so far, undoing included.
    """

    time_s: float
    generation: int
    xxh3_128: str


Record = SampleRecord | FrameRecord | EventRecord | EditRecord | PatientRecord

TOPICS: dict[str, type[Record]] = {
    "/sample": SampleRecord,
    "/frame": FrameRecord,
    "/event": EventRecord,
    "/edit": EditRecord,
    "/patient": PatientRecord,
}
