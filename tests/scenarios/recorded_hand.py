"""A second hand that operates on a small head, sample by sample."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from renderers.scene import AirSurface
from scenarios.endoscope import Endoscope, tip_frame
from scenarios.instrument_state import InstrumentState
from scenarios.operation import Operation
from scenarios.sample import Sample
from surgery.patient import OperatedPatient
from tests.surgery.heads import H, floor_at, remaining, volume, walled

FLOOR_MM = 10.0
"""z of the surface: tissue below, air above."""

ORBIT_MM = 3.0
"""z of what must not be hurt: everything below."""

ABOVE = tip_frame(np.array([12.0, 11.0, 18.0]), np.array([0.0, 0.0, -1.0]))


def operation_on(
    surface: AirSurface | None = None, has_orbit: bool = True
) -> Operation:
    """Begin an operation on a floor of one wall, with an orbit far below it."""
    surface = floor_at(FLOOR_MM) if surface is None else surface
    shape = surface.distance.shape
    depth = H * np.arange(shape[0])[:, None, None] - ORBIT_MM
    steps = np.rint(np.broadcast_to(depth, shape) / UNIT_MM).astype(np.int16)
    hazards = HazardVolumes({"orbit": volume(steps, 2500.0)})
    patient = OperatedPatient(surface, walled(surface))
    return Operation.on(patient, None, hazards if has_orbit else None)


@dataclass
class Hand:
    """A tool at a place; every call to `step` is a sample of it.

    All samples are kept, so that they can be stepped again.
    """

    operation: Operation = field(default_factory=operation_on)
    tip_mm: ArrayLike = (12.0, 11.0, FLOOR_MM)
    pointing: ArrayLike = (0.0, 0.0, -1.0)
    state: InstrumentState = field(default_factory=InstrumentState)
    time_s: float = 0.0
    samples: list[Sample] = field(default_factory=list)

    def step(self, after_s: float = 0.01, **state: Any) -> None:
        """Take the next sample; state: what changes of the tool's."""
        self.time_s += after_s
        self.state = replace(self.state, **state)
        sample = Sample(
            self.time_s,
            ABOVE,
            0.0,
            np.array(self.tip_mm, np.float64),
            np.array(self.pointing, np.float64),
            0,
            self.state,
        )
        self.samples.append(sample)
        self.operation.step(sample, ABOVE, Endoscope())

    def bite(self, **state: Any) -> None:
        """Open the jaw and close it."""
        self.step(jaw=0.0, **state)
        self.step(jaw=1.0)

    def go(self, to_mm: ArrayLike, seconds: float, rate_hz: float) -> None:
        """Move straight and evenly."""
        begin, end = np.array(self.tip_mm, float), np.array(to_mm, float)
        count = round(seconds * rate_hz)
        for n in range(1, count + 1):
            self.tip_mm = begin + (end - begin) * n / count
            self.step(1.0 / rate_hz)

    @property
    def edits(self) -> int:
        """Return how many cuts there are now."""
        return self.operation.patient.edits

    @property
    def counts(self) -> int:
        """Return what was taken, in the books' counts."""
        return self.operation.patient.books.counts


def replayed(
    samples: list[Sample], surface: AirSurface | None = None, has_orbit: bool = True
) -> Operation:
    """Step the same samples on a new head."""
    operation = operation_on(surface, has_orbit)
    for sample in samples:
        operation.step(sample, ABOVE, Endoscope())
    return operation


def assert_sound(operation: Operation, before: int) -> None:
    """All fields are finite, and what is missing is in the books to the count."""
    patient = operation.patient
    assert np.isfinite(patient.surface.distance.values).all()
    assert before - remaining(patient) == patient.books.counts
    assert patient.books.by_label.min() >= 0
    _, flesh, bone = patient._fills
    assert (flesh.astype(np.int64) + bone <= patient.fill).all()
