"""A patient whose tissue comes away: exact books, no drift, everything undone."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from anatomy.tissue import Label
from renderers.scene import AirSurface
from surgery import solids
from surgery.edit import CuttingLimits, Edit
from surgery.patient import OperatedPatient
from system import UserError
from tests.surgery.heads import (
    PAPYRACEA,
    SHAPE,
    H,
    floor_at,
    remaining,
    soft_patient,
    surface_of,
    volume,
    walled,
)

STRONG = CuttingLimits(force_n=20.0, bone_mm=1.0)
WEAK = CuttingLimits()
Place = tuple[float, float, float]
inside = st.tuples(st.floats(5, 18), st.floats(5, 16), st.floats(6, 12))
MIDDLE = np.array([12.0, 11.0, 5.0])


def shifted(*by: float) -> NDArray[np.float64]:
    place: NDArray[np.float64] = MIDDLE + np.array(by)
    return place


def cut(patient: OperatedPatient, rows: solids.Rows, taker: CuttingLimits) -> Edit:
    edit = patient.carve(rows, taker)
    assert edit is not None
    return edit


@pytest.mark.parametrize("radius", [1.5, 2.0, 3.0])
def test_a_capsule_deep_in_tissue_takes_its_volume(radius: float) -> None:
    patient = OperatedPatient(floor_at(19.5), None)
    a, b = np.array([8.0, 9.0, 8.0]), np.array([14.0, 12.0, 10.0])
    edit = cut(patient, solids.capsule(a, b, radius), WEAK)
    length = np.linalg.norm(b - a)
    exact = math.pi * radius**2 * length + 4 / 3 * math.pi * radius**3
    assert edit.volume_mm3 == pytest.approx(exact, rel=0.02)


@given(st.lists(st.tuples(inside, inside, st.floats(0.3, 2.5)), min_size=1, max_size=6))
@settings(max_examples=20)
def test_the_books_balance_to_the_count_and_everything_is_undone(
    cuts: list[tuple[Place, Place, float]],
) -> None:
    patient = soft_patient()
    first, before = patient.hash(), remaining(patient)
    for a, b, radius in cuts:
        rows = solids.capsule(a, b, radius, rough_mm=0.15, seed=3)
        edit = patient.carve(rows, STRONG)
        assert before - remaining(patient) == patient.books.counts
        if edit is not None:
            assert edit.counts >= 0
        # a second pass finds nothing
        assert patient.carve(rows, STRONG) is None
    generation = patient.generation
    while patient.undo() is not None:
        assert patient.generation > generation
        generation = patient.generation
    assert patient.hash() == first
    assert patient.books.counts == 0
    assert not patient.books.by_wall.any()


@pytest.mark.parametrize("steps", [2, 10, 1000])
def test_a_cut_in_many_steps_is_the_cut_in_one(steps: int) -> None:
    a, b = np.array([7.0, 9.0, 8.0]), np.array([16.0, 12.0, 10.5])
    capsule = partial(solids.capsule, radius_mm=1.5, rough_mm=0.15, seed=5)
    one, many = soft_patient(), soft_patient()
    one.carve(capsule(a, b), WEAK)
    at = np.linspace(0, 1, steps + 1)[:, None]
    for p, q in zip(a + at[:-1] * (b - a), a + at[1:] * (b - a), strict=True):
        many.carve(capsule(p, q), WEAK)
    # the parts' ends are rounded apart by the last bits of float64
    apart = np.abs(one.surface.distance.values - many.surface.distance.values)
    assert apart.max() < 1e-5
    assert many.books.counts == pytest.approx(one.books.counts, abs=60)


@given(st.permutations(range(4)))
@settings(max_examples=10)
def test_the_order_of_cuts_makes_no_difference(order: list[int]) -> None:
    rows = [
        solids.capsule(shifted(n, 0, 3.6), shifted(n, 2, 5), 1.0 + 0.2 * n)
        for n in range(4)
    ]
    straight, mixed = soft_patient(), soft_patient()
    for n in range(4):
        straight.carve(rows[n], WEAK)
        mixed.carve(rows[order[n]], WEAK)
    assert straight.hash() == mixed.hash()
    assert straight.books.counts == mixed.books.counts


@given(inside, inside, st.floats(0.3, 2.5), st.sampled_from([STRONG, WEAK]))
@settings(max_examples=20, deadline=None)
def test_what_a_cut_would_take_is_what_it_takes(
    start: Place, end: Place, radius: float, taker: CuttingLimits
) -> None:
    """To the count, but for pieces that hang on nothing then; and nothing changes."""
    surface = floor_at(10.0)
    patient = OperatedPatient(surface, walled(surface))
    patient.carve(solids.capsule(MIDDLE, shifted(2.0, 1.0, 0.0), 1.5), STRONG)
    before = patient.hash()
    rows = solids.capsule(np.array(start), np.array(end), radius)
    told = patient.would_take(rows, taker)
    assert patient.hash() == before
    edit = patient.carve(rows, taker)
    taken = {} if edit is None else dict(edit.taken_mm3)
    if edit is not None and edit.pieces_mm3:
        assert all(mm3 <= taken[name] for name, mm3 in told.items())
    else:
        assert {n: v for n, v in told.items() if v} == pytest.approx(taken)


def test_a_bite_in_the_air_counts_nothing() -> None:
    patient = soft_patient()
    first = patient.hash()
    assert patient.carve(solids.capsule([9, 9, 16], [9, 12, 16], 2.0), STRONG) is None
    assert patient.hash() == first
    assert patient.generation == patient.edits == 0
    assert patient.touched is None
    # as one outside the head
    assert patient.carve(solids.capsule([900, 9, 9], [900, 9, 9], 2.0), WEAK) is None


def test_bone_beyond_a_tools_force_stays() -> None:
    surface = floor_at(10.0)
    patient = OperatedPatient(surface, walled(surface))
    edit = cut(patient, solids.capsule([12, 11, 9], [12, 11, 9], 2.5), WEAK)
    assert edit.bone_mm3 == {}
    assert set(edit.taken_mm3) == {"mucosa"}
    at = patient.surface.distance.sample(np.array([12.0, 11.0, 8.0]))
    assert at > 0.5  # two below the surface: mucosa was one thick
    # bared exactly at the plate
    assert patient.surface.distance.sample(np.array([12.0, 11.0, 9.0])) == (
        pytest.approx(0.0, abs=0.02)
    )


def test_a_plate_thinner_than_a_voxel_is_counted_by_its_thickness() -> None:
    surface = floor_at(10.0)
    patient = OperatedPatient(surface, walled(surface))
    radius = 2.5
    edit = cut(patient, solids.capsule([12, 11, 9], [12, 11, 9], radius), STRONG)
    # the plate lies between 1.0 and 1.3 below the surface, through the ball's middle
    dense = np.stack(
        np.meshgrid(*[np.arange(-radius, radius, 0.02)] * 2, indexing="ij"), -1
    )
    reach2 = radius**2 - (dense**2).sum(-1)
    height = np.sqrt(np.maximum(reach2, 0))
    chord = np.minimum(height, 0.0 + 0 * height) + np.minimum(height, 0.3)
    exact = chord.sum() * 0.02**2
    assert edit.bone_mm3["lamina papyracea"] == pytest.approx(exact, rel=0.05)
    assert edit.taken_mm3["lamina papyracea"] == edit.bone_mm3["lamina papyracea"]


@given(
    st.floats(0.6, 3.0),
    st.floats(7.0, 8.0),
    st.floats(-0.45, 0.45),
    st.floats(-0.45, 0.45),
)
@settings(max_examples=25)
def test_a_wall_between_two_airs_has_its_bone_once(
    wide_mm: float, middle_mm: float, tilt_y: float, tilt_x: float
) -> None:
    kind = replace(PAPYRACEA, mucosa_mm=0.2, bone_mm=0.4)
    z, y, x = np.meshgrid(*(H * np.arange(n) for n in SHAPE), indexing="ij")
    off = z - middle_mm - tilt_y * (y - 11) - tilt_x * (x - 12)
    off /= math.sqrt(1 + tilt_y**2 + tilt_x**2)
    surface = surface_of((wide_mm / 2 - np.abs(off)).astype(np.float32))
    patient = OperatedPatient(surface, walled(surface, kind))
    radius, middle = 6.0, [12.0, 11.0, middle_mm]
    edit = cut(patient, solids.capsule(middle, middle, radius), STRONG)

    def within(half: float) -> float:
        """Return the volume of a slab through the middle of the ball."""
        return 2 * math.pi * (radius**2 * half - half**3 / 3)

    outer = wide_mm / 2 - kind.mucosa_mm
    exact = within(outer) - within(max(outer - kind.bone_mm, 0.0))
    assert edit.bone_mm3["lamina papyracea"] == pytest.approx(exact, rel=0.05)


def test_what_hangs_on_nothing_comes_away_and_is_booked() -> None:
    patient = soft_patient()
    # a knob of 1 mm on a stalk, whose stalk is cut
    z = H * np.arange(40)[:, None, None]
    y = H * np.arange(44)[None, :, None]
    x = H * np.arange(48)[None, None, :]
    knob = 1.2 - np.sqrt((x - 12) ** 2 + (y - 11) ** 2 + (z - 13) ** 2)
    stalk = np.minimum(0.6 - np.sqrt((x - 12) ** 2 + (y - 11) ** 2) + 0 * z, 13 - z)
    floor = 10.0 - z + 0 * knob
    shape = np.maximum(np.maximum(knob, stalk), floor)
    patient = OperatedPatient(surface_of(np.clip(shape, -12, 6).astype("f4")), None)
    before = remaining(patient)
    edit = cut(patient, solids.capsule([10, 11, 11], [14, 11, 11], 0.75), WEAK)
    assert edit.pieces_mm3 == pytest.approx(4 / 3 * math.pi * 1.2**3, rel=0.35)
    assert patient.surface.distance.sample(np.array([12.0, 11.0, 13.0])) < 0
    assert before - remaining(patient) == patient.books.counts
    assert patient.books.mm3(patient.books.pieces) == pytest.approx(edit.pieces_mm3)


def test_edits_of_a_stroke_are_undone_together() -> None:
    patient = soft_patient()
    patient.carve(solids.capsule([9, 9, 10], [9, 9, 10], 1.0), WEAK)
    after_one = patient.hash()
    for n in range(5):
        at = [11 + n, 9, 10]
        patient.carve(solids.capsule(at, at, 1.0), WEAK, stroke=7)
    change = patient.undo()
    assert change is not None
    assert patient.hash() == after_one
    assert change.low[0] <= 21 < 31 <= change.high[0]


def test_ct_numbers_follow_the_cuts_and_come_back() -> None:
    surface = floor_at(10.0)
    z = H * np.arange(40)
    hu = np.where(z < 10, 40, -1000).astype(np.int16)
    ct = volume(np.broadcast_to(hu[:, None, None], (40, 44, 48)).copy(), -1000.0)
    patient = OperatedPatient(surface, None, ct=ct)
    patient.carve(solids.capsule(MIDDLE, MIDDLE, 2.0), WEAK)
    assert patient.ct is not None
    i, j, k = np.rint(MIDDLE / H).astype(int)
    assert patient.ct.values[k, j, i] == -1000
    assert patient.ct.values[0, 0, 0] == 40
    patient.undo()
    np.testing.assert_array_equal(patient.ct.values, ct.values)


def test_what_is_drawn_knows_the_layers() -> None:
    surface = floor_at(10.0)
    patient = OperatedPatient(surface, walled(surface, ground=Label.THICK_BONE))
    wounds = patient.surface.wounds
    assert wounds is not None
    assert wounds.pristine is surface.distance
    assert set(np.unique(wounds.flesh.values)) == {50}
    assert set(np.unique(wounds.bone.values)) == {15}
    assert set(np.unique(wounds.deep.values)) == {255}
    assert not wounds.film.values.any()


def test_walls_of_another_head_are_refused() -> None:
    small = floor_at(10.0, (20, 20, 20))
    with pytest.raises(UserError, match="do not fit"):
        OperatedPatient(floor_at(10.0), walled(small, PAPYRACEA))


def test_a_slanted_grid_is_cut_where_the_tool_is() -> None:
    surface = floor_at(10.0)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    parts = [
        type(v)(v.values, v.spacing_mm, np.array([3.0, -4, 5]), turn, v.background)
        for v in (surface.distance, surface.blood, surface.skin)
    ]
    patient = OperatedPatient(AirSurface(parts[0], parts[1], parts[2]), None)
    at = turn @ MIDDLE + [3, -4, 5]
    patient.carve(solids.capsule(at, at, 2.0), WEAK)
    assert patient.surface.distance.sample(at) == pytest.approx(-2.0, abs=0.3)
