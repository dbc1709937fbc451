"""What a recorded session's stream holds: samples, frames and events."""

import msgspec
import numpy as np

from disk import UserError
from scenarios.session import Sample


class SampleRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One measured sample; see `scenarios.session.Sample`."""

    time_s: float
    device_from_tip: list[float]
    roll_deg: float
    instrument_tip_mm: list[float]
    instrument_pointing: list[float]
    buttons: int

    @classmethod
    def of(cls, sample: Sample) -> "SampleRecord":
        """Make the record of a sample. Floats keep all their bits."""
        return cls(
            sample.time_s,
            [float(v) for v in sample.device_from_tip.ravel()],
            sample.roll_deg,
            [float(v) for v in sample.instrument_tip_mm],
            [float(v) for v in sample.instrument_pointing],
            sample.buttons,
        )

    def sample(self) -> Sample:
        """Return the sample back, bit by bit."""
        if len(self.device_from_tip) != 16:
            raise UserError(
                f"a pose has 16 numbers, the record has {len(self.device_from_tip)}"
            )
        return Sample(
            self.time_s,
            np.array(self.device_from_tip).reshape(4, 4),
            self.roll_deg,
            np.array(self.instrument_tip_mm),
            np.array(self.instrument_pointing),
            self.buttons,
        )


class FrameRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One picture as it was shown.

    sample: index of the sample it shows, counted from 0 in this stream.
    gain: the camera's gain; stored because it depends on all frames before.
    xxh3_128: hash of the picture's bytes. blake2b: what stood there in recordings of
    looks before 3, whose pictures are not compared.
    """

    number: int
    sample: int
    gain: float
    clearance_mm: float
    xxh3_128: str = ""
    blake2b: str = ""


class EventRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Something worth remembering: a snapshot request, a device error, the end."""

    time_s: float
    kind: str
    text: str


Record = SampleRecord | FrameRecord | EventRecord

TOPICS: dict[str, type[SampleRecord] | type[FrameRecord] | type[EventRecord]] = {
    "/sample": SampleRecord,
    "/frame": FrameRecord,
    "/event": EventRecord,
}
