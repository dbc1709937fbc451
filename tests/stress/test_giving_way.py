"""Tissue gives way to the tool of a recorded sample, and only what is shown bends."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from anatomy.tissue import Label
from anatomy.wall_layers import WallKind
from renderers.scene import Change, ChangeKind
from scenarios.endoscope import Endoscope, tip_frame
from scenarios.instrument_state import InstrumentState
from scenarios.instruments.catalogue import instrument_named
from scenarios.operation import Operation
from scenarios.sample import Sample, tool_frame
from surgery.patient import OperatedPatient
from tests.surgery.heads import floor_at, walled

FLOOR = 10.0
MIDDLE = np.array([11.5, 10.5, FLOOR])
DOWN = np.array([0.0, 0.0, -1.0])
SCOPE = tip_frame(MIDDLE + 9.0, DOWN)
TURBINATE = WallKind("", 1.0, 0.0, Label.MIDDLE_TURBINATE, Label.MIDDLE_TURBINATE)
FORCEPS = "straight forceps"


@cache
def sinking(name: str) -> float:
    """Return how far the lowest place of a tool's end ball is from its origin, down."""
    frame = tip_frame(np.zeros(3), DOWN)
    middle, radius = instrument_named(name).tip_ball(frame)
    return float(radius - middle[2])


def sample_at(
    time_s: float, depth: float, state: InstrumentState, aside: float = 0.0
) -> Sample:
    """Hold a tool down, its end ball so deep in the floor."""
    name = state.name
    at = MIDDLE + np.array([aside, 0.0, sinking(name) - depth])
    return Sample(time_s, SCOPE, 0.0, at, DOWN, 0, state)


class Shown:
    """Steps an operation and keeps up with what it says to have changed."""

    def __init__(self, patient: OperatedPatient) -> None:
        self.operation = Operation.on(patient, None, None)
        self.scope = Endoscope()
        surface = self.operation.pushing.surface
        assert surface.wounds is not None
        self.fields = surface.distance.values, surface.wounds.pristine.values
        self.kept = tuple(values.copy() for values in self.fields)
        self.changes: list[Change] = []

    def step(self, *samples: Sample) -> None:
        for sample in samples:
            self.operation.step(sample, SCOPE, self.scope)
        changes = self.operation.take_changes()
        for change in changes:
            k, j, i = (slice(change.low[a], change.high[a] + 1) for a in (2, 1, 0))
            for kept, values in zip(self.kept, self.fields, strict=True):
                kept[k, j, i] = values[k, j, i]
        for kept, values in zip(self.kept, self.fields, strict=True):
            # nothing changes that nobody is told of
            np.testing.assert_array_equal(kept, values)
        self.changes += changes

    def rest(self) -> NDArray[np.float32]:
        values = self.operation.patient.surface.distance.values
        assert values.dtype == np.float32
        return values

    def bent(self) -> float:
        return float(np.abs(self.fields[0] - self.rest()).max())


def soft() -> Shown:
    return Shown(OperatedPatient(floor_at(FLOOR), None))


def turbinate() -> OperatedPatient:
    surface = floor_at(FLOOR)
    return OperatedPatient(surface, walled(surface, TURBINATE, Label.MIDDLE_TURBINATE))


def test_a_tool_dents_what_is_shown_and_it_springs_back() -> None:
    shown = soft()
    before, held = shown.rest().copy(), InstrumentState(FORCEPS)
    shown.step(sample_at(0.0, -1.0, held))
    assert shown.bent() == 0
    shown.step(sample_at(0.1, 0.5, held))
    assert shown.bent() > 0.3
    shown.step(sample_at(0.2, -1.0, held))
    assert shown.bent() > 0
    shown.step(sample_at(3.0, -1.0, held))
    assert shown.bent() == 0
    np.testing.assert_array_equal(shown.rest(), before)
    assert {change.kind for change in shown.changes} == {ChangeKind.DENT}
    assert shown.operation.patient.edits == 0


def test_generations_of_cuts_and_dents_are_one_count() -> None:
    shown = soft()
    way = np.linspace(-0.5, 1.0, 12)
    for n, depth in enumerate(way.tolist()):
        state = InstrumentState(FORCEPS, jaw=0.0 if n % 4 < 2 else 1.0)
        shown.step(sample_at(0.05 * n, depth, state))
    undone = InstrumentState(FORCEPS, undone=1)
    shown.step(sample_at(0.7, 0.2, undone))
    numbers = [change.generation for change in shown.changes]
    assert numbers == sorted(set(numbers))
    kinds = {change.kind for change in shown.changes}
    assert kinds >= {ChangeKind.DENT, ChangeKind.CUT}
    assert shown.operation.patient.generation == numbers[-1]


def test_a_bite_takes_what_the_forceps_dented() -> None:
    """The jaws go down into tissue that yields; closing, they take it."""
    shown = soft()
    shown.step(sample_at(0.0, 0.8, InstrumentState(FORCEPS, jaw=0.0)))
    assert shown.bent() > 0.3
    assert shown.operation.patient.books.counts == 0
    shown.step(sample_at(0.1, 0.8, InstrumentState(FORCEPS, jaw=1.0)))
    taken = shown.operation.patient.books.counts
    assert taken > 0
    unpushed = Shown(OperatedPatient(floor_at(FLOOR), None))
    unpushed.step(sample_at(0.0, 0.8, InstrumentState(FORCEPS, jaw=0.0)))
    back = unpushed.operation.pushing.release(2)
    assert back is not None
    unpushed.operation.changes.append(back)
    unpushed.step(sample_at(0.01, 0.8, InstrumentState(FORCEPS, jaw=1.0)))
    assert unpushed.operation.patient.books.counts == taken


def test_a_sweeping_tool_pushes_only_while_it_rests() -> None:
    shown = soft()
    idle = InstrumentState("microdebrider")
    cuts = InstrumentState("microdebrider", is_working=True, is_sucking=True)
    shown.step(sample_at(0.0, 0.5, idle))
    assert shown.bent() > 0.3
    shown.step(sample_at(0.1, 3.0, cuts))
    shown.step(sample_at(3.0, 3.0, cuts))
    assert shown.operation.patient.books.counts > 0
    assert shown.bent() == 0


def test_a_turbinate_stays_aside_and_is_cut_where_it_is_shown() -> None:
    shown = Shown(turbinate())
    held = InstrumentState(FORCEPS)
    for n in range(20):
        shown.step(sample_at(0.05 * n, 0.1 * n, held))
    shown.step(sample_at(3.0, -8.0, held), sample_at(6.0, -8.0, held))
    pushing = shown.operation.pushing
    assert len(pushing.shifts) > 0
    assert shown.bent() > 0.3
    shift = pushing.shifts[-1]
    assert shift[5] < 0
    # a bite just below the floor as it is shown now
    surface = pushing.surface.distance
    z = np.arange(4.0, FLOOR, 0.05)
    column = np.stack([np.full_like(z, MIDDLE[0]), np.full_like(z, MIDDLE[1]), z], 1)
    top = float(z[np.flatnonzero(surface.sample(column) > 0)[-1]])
    assert top < FLOOR - 0.3
    depth = FLOOR - top + 0.5
    shown.step(sample_at(6.1, depth, InstrumentState(FORCEPS, jaw=0.0)))
    shown.step(sample_at(6.2, depth, InstrumentState(FORCEPS, jaw=1.0)))
    edit = shown.operation.take_edits()[-1]
    low = edit.solids[:, [3, 6]].min()
    frame = tool_frame(sample_at(6.2, depth, held))
    rows = instrument_named(FORCEPS).working_volume(frame, 0.0)
    # it was taken at rest, nearer to where the floor was
    assert low > rows[:, [3, 6]].min() + 0.2


def test_the_same_samples_show_the_same_whenever_it_is_looked_at() -> None:
    rng = np.random.default_rng(3)
    samples = [
        sample_at(
            0.011 * n,
            float(np.sin(0.15 * n)),
            InstrumentState(FORCEPS, jaw=float(n // 9 % 2)),
            float(rng.uniform(-0.1, 0.1)),
        )
        for n in range(60)
    ]
    often, seldom = soft(), soft()
    for sample in samples:
        often.step(sample)
    seldom.step(*samples)
    for a, b in zip(often.fields, seldom.fields, strict=True):
        np.testing.assert_array_equal(a, b)
    assert often.operation.patient.hash() == seldom.operation.patient.hash()
    assert often.operation.patient.generation == seldom.operation.patient.generation
    assert len(seldom.changes) < len(often.changes)


@pytest.mark.parametrize("name", ["curette", FORCEPS, "microdebrider"])
def test_a_lost_device_lets_go(name: str) -> None:
    shown = soft()
    shown.step(sample_at(0.0, 0.5, InstrumentState(name)))
    lost = replace(
        sample_at(0.1, 0.5, InstrumentState(name)), instrument_tip_mm=np.full(3, np.nan)
    )
    shown.step(lost, replace(lost, time_s=3.0))
    assert shown.bent() == 0
