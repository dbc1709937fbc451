"""A patient goes back to what it was, and on from there as it went before."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from renderers.scene import Volume
from surgery.edit import CuttingLimits
from surgery.film import BloodFilm, Suction
from surgery.lens import Lens
from surgery.patient import OperatedPatient
from surgery.solids import capsule
from tests.surgery.heads import floor_at, walled

PLACES = [np.array([9.0 + 2 * n, 10.0 + (n % 3), 9.6]) for n in range(4)]
DOWN = np.diag([1.0, 1.0, -1.0])


class Head:
    """A patient that bleeds, and the steps that it went through."""

    def __init__(self) -> None:
        surface = floor_at(10.0)
        hu = surface.distance.with_values(
            np.full(surface.distance.shape, 40, np.int16), -1000
        )
        self.patient = OperatedPatient(surface, walled(surface), None, hu)
        self.film = BloodFilm(self.patient.surface, self.patient.wounds_film)
        self.lens = Lens(self.patient.surface, 2.0)
        self.time_s = 0.0

    def step(self, action: int) -> None:
        self.time_s += 0.4
        if action < len(PLACES):
            place = PLACES[action]
            rows = capsule(place, place + np.array([0, 0, 1.0]), 1.4)
            edit = self.patient.carve(rows, CuttingLimits(9.0, 1.0), time_s=self.time_s)
            if edit is not None:
                self.film.after_edit(edit.change)
        elif action == len(PLACES):
            change = self.patient.undo()
            if change is not None:
                self.film.after_edit(change)
        else:
            self.film.suck(Suction(PLACES[action % 4], 3.0) if action % 2 else None)
            self.lens.wash()
        self.film.advance(self.time_s)
        self.lens.advance(self.time_s, np.vstack([PLACES[action % 4], DOWN]), 0.5)

    def seen(self) -> list[bytes]:
        """All that anybody sees of it, and the books."""
        patient, film, ct = self.patient, self.film, self.patient.ct
        assert isinstance(ct, Volume)
        arrays = *patient._fills, patient.wounds_film, ct.values, film._spread
        parts = [array.tobytes() for array in arrays]
        words = (
            patient.hash(),
            patient.books,
            patient.edits,
            film.hash(),
            film.arteries,
            film.held,
            self.lens.state,
            self.lens.touches_s,
        )
        return [*parts, repr(words).encode()]


actions = st.lists(st.integers(0, 6), min_size=1, max_size=6)


@settings(max_examples=12)
@given(before=actions, between=actions, after=actions)
def test_going_back_is_never_having_gone(
    before: list[int], between: list[int], after: list[int]
) -> None:
    """To the bit: tissue, blood, lens, books; what follows, undoing included, too."""
    straight, head = Head(), Head()
    for action in before:
        straight.step(action)
        head.step(action)
    patient, film, lens = head.patient, head.film, head.lens
    state = patient.checkpoint(), film.checkpoint(), lens.checkpoint(), head.time_s
    known = head.seen()
    assert known == straight.seen()
    for action in between:
        head.step(action)
    generation, other = patient.generation, head.seen()
    onward = patient.checkpoint(), film.checkpoint(), lens.checkpoint(), head.time_s
    was = patient.surface.distance.values.copy()
    change = patient.restore(state[0])
    film.restore(state[1])
    lens.restore(state[2])
    head.time_s = state[3]
    assert head.seen() == known
    differs = np.argwhere(patient.surface.distance.values != was)[:, ::-1]
    assert patient.generation >= generation
    if change is None:
        assert not len(differs)
    else:
        assert change.generation == patient.generation == generation + 1
        assert np.all((differs >= change.low) & (differs <= change.high))
    for action in after:
        straight.step(action)
        head.step(action)
    assert head.seen() == straight.seen()
    patient.restore(onward[0])
    film.restore(onward[1])
    lens.restore(onward[2])
    assert head.seen() == other
    while patient.undo() is not None:
        pass
    assert patient.hash() == Head().patient.hash()


def test_the_film_tells_where_going_back_shows() -> None:
    head = Head()
    dry = head.film.checkpoint()
    for action in (0, 1, 2):
        head.step(action)
    head.film.drawn_box()
    wet = np.argwhere(head.patient.wounds_film)[:, ::-1]
    assert len(wet) > 20
    head.film.restore(dry)
    box = head.film.drawn_box()
    assert box is not None
    assert np.all((wet >= box[0]) & (wet <= box[1]))
    assert not head.patient.wounds_film.any()
    assert head.film.wet_cells == 0


def test_a_state_is_no_part_of_the_patient() -> None:
    """Later edits leave it as it is."""
    head = Head()
    head.step(0)
    states = head.patient.checkpoint(), head.film.checkpoint()
    kept = states[0].distance.copy(), states[1].cells[1].copy()
    counts = states[0].books.counts
    for action in (1, 4, 2, 3):
        head.step(action)
    assert_array_equal(states[0].distance, kept[0])
    assert_array_equal(states[1].cells[1], kept[1])
    assert states[0].books.counts == counts
