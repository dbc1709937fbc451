"""Laws of the blood film: nothing gets lost, it runs downhill, and replays alike."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import brentq

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from anatomy.tissue import Label
from renderers.scene import AirSurface, Volume
from surgery import film as blood
from surgery.edit import CuttingLimits
from surgery.film import BleedingRate, BloodFilm, Suction
from surgery.kernels.film_cells import VISCOUS
from surgery.patient import OperatedPatient
from surgery.solids import capsule
from system import UserError
from tests.surgery.pouring import bleed_from, pour

H = 0.5
DOWN = (0.0, 0.0, -1.0)
Doubles = NDArray[np.float64]
Field = Callable[[Doubles, Doubles, Doubles], Doubles]


def head(field: Field, count: tuple[int, int, int]) -> AirSurface:
    """Return a head of a field of x, y, z in mm, on `count` voxels along them."""
    nx, ny, nz = count
    z, y, x = np.meshgrid(
        *(H * np.arange(n) for n in (nz, ny, nx)), indexing="ij", sparse=True
    )
    d = np.broadcast_to(field(x, y, z), (nz, ny, nx)).astype(np.float32)
    volume = Volume(d, np.full(3, H), np.zeros(3), background=6.0)
    none = volume.with_values(np.zeros(d.shape, np.uint8), 0.0)
    return AirSurface(volume, none, none)


def patient_of(field: Field, count: tuple[int, int, int]) -> OperatedPatient:
    return OperatedPatient(head(field, count), None)


def film_of(
    patient: OperatedPatient, gravity: tuple[float, float, float] = DOWN
) -> BloodFilm:
    film = BloodFilm(patient.surface, patient.wounds_film, gravity=gravity)
    film.advance(0.0)
    return film


def unaccounted(film: BloodFilm) -> int:
    books = film.books
    elsewhere = film.held + books.sucked + int(books.left.sum())
    return int(books.bled.sum()) - elsewhere


def places(film: BloodFilm, count: tuple[int, int, int]) -> Doubles:
    voxels, _ = film.thickness
    nx, ny, _ = count
    return H * np.stack(
        [voxels % nx, voxels // nx % ny, voxels // (nx * ny)], axis=1
    ).astype(np.float64)


def cave(x: Doubles, y: Doubles, z: Doubles) -> Doubles:
    """A ball of air with a bar across: floor, walls, ceiling and overhangs."""
    ball = np.sqrt((x - 12) ** 2 + (y - 12) ** 2 + (z - 12) ** 2) - 10
    bar = 2.0 - np.hypot(x - 12, z - 13)
    found: Doubles = np.maximum(ball, bar)
    return found


CAVE = 49, 49, 49


@settings(max_examples=8)
@given(st.data())
def test_nothing_is_lost_whatever_is_done(data: st.DataObject) -> None:
    """Bled = held + sucked + left, to the last unit, and no cell holds less than none.

    What is drawn is what was drawn anew from the same state.
    """
    patient = patient_of(cave, CAVE)
    angle = data.draw(st.floats(0, 6.3))
    film = film_of(patient, (math.sin(angle), 0.3, -math.cos(angle)))
    time_s = 0.0
    place = st.tuples(*[st.floats(3, 21)] * 3)
    for _ in range(data.draw(st.integers(1, 10))):
        action = data.draw(st.sampled_from(("cut", "undo", "suck", "rest", "pour")))
        at = np.array(data.draw(place))
        change = None
        if action == "cut":
            to = at + data.draw(st.floats(0, 2))
            edit = patient.carve(capsule(at, to, 1.5), CuttingLimits())
            change = None if edit is None else edit.change
        elif action == "undo":
            change = patient.undo()
        elif action == "pour":
            toward = (at - 12) / max(float(np.linalg.norm(at - 12)), 1e-3)
            pour(film, 12 + 10 * toward, 20.0)
        film.suck(Suction(at, 4.0, 60.0) if action == "suck" else None)
        if change is not None:
            film.after_edit(change)
        assert unaccounted(film) == 0
        time_s += data.draw(st.floats(0.1, 2.0))
        film.advance(time_s)
        assert unaccounted(film) == 0
        _, thick = film.thickness
        assert thick.min(initial=0.0) >= 0.0
        assert film.wet_cells <= np.count_nonzero(patient.surface.distance.values <= 0)


def slope(degrees: float, turn: float, count: tuple[int, int, int]) -> Field:
    """Return a plane through the middle that falls by `degrees`, its air above."""
    a, middle = math.radians(degrees), H * np.array(count) / 2
    n = math.sin(a) * math.cos(turn), math.sin(a) * math.sin(turn), math.cos(a)
    return lambda x, y, z: (
        -((x - middle[0]) * n[0] + (y - middle[1]) * n[1] + (z - middle[2]) * n[2])
    )


@pytest.mark.parametrize(
    ("degrees", "turn"), [(30.0, 0.0), (60.0, 0.0), (45.0, 0.4), (30.0, 0.785)]
)
def test_a_front_runs_as_fast_as_a_thin_film(degrees: float, turn: float) -> None:
    """Huppert 1982: 9/10 of A mm2 on a slope lie within .9^(2/3) of (9 A^2 g t / 4
    nu)^(1/3). Within 17 %: lanes of cells that got more run ahead."""
    count = 140, 80, 80
    film = film_of(patient_of(slope(degrees, turn, count), count))
    film.hold_mm = 0.0
    a, middle = math.radians(degrees), H * np.array(count) / 2
    n = np.array(
        [math.sin(a) * math.cos(turn), math.sin(a) * math.sin(turn), math.cos(a)]
    )
    down = (np.array(DOWN) + n * n[2]) / math.sin(a)
    across = np.cross(n, down)
    start = middle - down * min(15.0, 14.0 / math.sin(a))
    step = 0.25
    for at in np.arange(-12, 12, step):
        pour(film, start + across * at, 2.0 * step)
    film.advance(2.0)
    _, thick = film.thickness
    reached = (places(film, count) - start) @ down
    inner = np.abs((places(film, count) - start) @ across) < 4
    reached, thick = reached[inner], thick[inner]
    order = np.argsort(reached)
    share = np.cumsum(thick[order]) / thick.sum()
    front = reached[order][np.searchsorted(share, 0.9)]
    law = (9 * 2.0**2 * 3 * VISCOUS * math.sin(a) * 2.0 / 4) ** (1 / 3)
    assert front == pytest.approx(0.9 ** (2 / 3) * law, rel=0.17)


def test_blood_runs_downhill_only() -> None:
    count = 80, 60, 60
    film = film_of(patient_of(slope(40.0, 0.3, count), count))
    pour(film, H * np.array(count) / 2, 0.2)
    highest = places(film, count)[:, 2].max()
    mean = math.inf
    for time_s in (0.2, 0.5, 1.0, 2.0, 4.0):
        film.advance(time_s)
        _, thick = film.thickness
        heights = places(film, count)[:, 2]
        assert heights.max() <= highest
        now = float((heights * thick).sum() / thick.sum())
        assert now <= mean
        mean = now


def test_a_thin_film_stays_where_it_is() -> None:
    count = 40, 40, 40
    film = film_of(patient_of(slope(70.0, 0.0, count), count))
    pour(film, H * np.array(count) / 2, 0.9 * blood.HOLD_MM * H**2)
    film.advance(5.0)
    assert film.wet_cells == 1


def test_a_pool_is_level_and_as_high_as_its_volume() -> None:
    """A cap of a ball: V = pi h^2 (3 R - h) / 3. Level within .01 mm, and as high
    within .05 mm."""
    radius, volume = 12.0, 300.0
    count = 60, 60, 60

    def ball(x: Doubles, y: Doubles, z: Doubles) -> Doubles:
        return np.sqrt((x - 15) ** 2 + (y - 15) ** 2 + (z - 15) ** 2) - radius

    film = film_of(patient_of(ball, count))
    pour(film, (20.0, 15.0, 5.0), volume)
    film.advance(20.0)
    at = places(film, count)
    _, thick = film.thickness
    out = 15.0 - at
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    ground = 15.0 - radius * out[:, 2]
    pool = (out[:, 2] > 0.3) & (thick > 0.3)
    stands = ground[pool] + (thick[pool] - blood.HOLD_MM) / out[pool, 2]
    cap = brentq(lambda h: np.pi * h**2 * (3 * radius - h) / 3 - volume, 0, radius)
    assert np.ptp(stands) < 0.05
    assert np.median(stands) == pytest.approx(15.0 - radius + cap, abs=0.05)
    before = film.hash()
    film.advance(30.0)
    assert film.hash() == before, "a level pool must rest"


def test_a_mirrored_head_bleeds_mirrored() -> None:
    """To a thousandth: normals are summed in another order."""
    count = 49, 49, 49
    found = []
    for sign in (1.0, -1.0):

        def leaning(x: Doubles, y: Doubles, z: Doubles, sign: float = sign) -> Doubles:
            return cave(x, y, z + 0.15 * sign * (x - 12))

        film = film_of(patient_of(leaning, count))
        pour(film, (12 + sign * 3.0, 14.0, 15.0), 30.0)
        film.advance(6.0)
        column = np.rint(places(film, count)[:, 0] / H).astype(int)
        across = np.bincount(column, film.thickness[1], minlength=count[0])
        found.append(across[:: int(sign)])
    np.testing.assert_allclose(found[0], found[1], atol=1e-3 * found[0].max())


def test_drops_fall_from_what_hangs() -> None:
    """Blood on a ceiling drips from 1.5 mm on, and lands on the floor right below."""
    count = 30, 30, 40

    def room(x: Doubles, y: Doubles, z: Doubles) -> Doubles:
        return np.maximum(3.2 - z, z - 14.3) + 0 * (x + y)

    film = film_of(patient_of(room, count))
    pour(film, (7.0, 8.0, 14.2), 0.9 * blood.DROP_MM * H**2)
    film.advance(1.0)
    assert film.wet_cells == 1
    pour(film, (7.0, 8.0, 14.2), 0.2 * blood.DROP_MM * H**2)
    film.advance(1.2)
    at = places(film, count)
    assert at[:, 2].min() < 4.5
    floor = at[at[:, 2] < 5]
    np.testing.assert_allclose(floor.mean(axis=0)[:2], (7.0, 8.0), atol=H)
    assert unaccounted(film) == 0


@pytest.mark.parametrize("pieces", [1, 7, 400])
def test_samples_between_change_nothing(pieces: int) -> None:
    """Fixed steps: any number of samples gives the same bits."""
    hashes = []
    for count in (3, pieces):
        patient = patient_of(cave, CAVE)
        film = film_of(patient)
        edit = patient.carve(
            capsule((12, 12, 15), (12, 12, 14.5), 1.4), CuttingLimits()
        )
        assert edit is not None
        film.after_edit(edit.change)
        for n in range(count):
            film.advance(6.0 * (n + 1) / count)
        hashes.append((film.hash(), patient.wounds_film.tobytes()))
    assert hashes[0] == hashes[1]


def test_a_source_clots() -> None:
    """rate t / (1 + t / tau) is out by t, and never more than rate times tau."""
    film = film_of(patient_of(cave, CAVE))
    bleed_from(film, (12.0, 12.0, 2.2), BleedingRate(0.6, 2.0))
    for t in (1.0, 4.0, 30.0):
        film.advance(t)
        assert film.books.bled_ml == pytest.approx(0.01 * t / (1 + t / 2), abs=1e-8)
    assert film.books.bled[blood.ARTERY] * blood.UNIT_MM3 / 1000 < 0.02


def test_suction_takes_what_is_in_reach_and_no_more_than_its_flow() -> None:
    count = 60, 60, 30
    patient = patient_of(lambda x, y, z: 4.2 - z + 0 * (x + y), count)
    film = film_of(patient)
    pour(film, (8.0, 15.0, 4.5), 5.0)
    pour(film, (24.0, 15.0, 4.5), 5.0)
    film.advance(3.0)
    film.suck(Suction(np.array([8.0, 15.0, 5.0]), 8.0, 0.06))
    film.advance(3.5)
    assert film.books.sucked_ml <= 0.5e-3
    assert film.books.sucked_ml == pytest.approx(0.5e-3, rel=0.01)
    film.advance(20.0)
    held = film.held * blood.UNIT_MM3
    assert held == pytest.approx(5.0, abs=0.1), "the far pool is out of reach"
    assert unaccounted(film) == 0


def test_a_cut_bleeds_by_its_area_and_near_an_artery_far_more() -> None:
    count = 60, 60, 40
    surface = head(lambda x, y, z: 9.2 - z + 0 * (x + y), count)
    rates = []
    for gap in (20.0, 2.2):
        patient = OperatedPatient(surface, None)
        x, y, z = np.meshgrid(*(H * np.arange(n) for n in count), indexing="ij")
        away = np.hypot(y - 15, z - 9.2 + gap) - 0.8 + 0 * x
        steps = np.clip(np.rint(away.T / UNIT_MM), -2500, 2500).astype(np.int16)
        volume = surface.distance.with_values(steps, 2500.0)
        film = BloodFilm(
            patient.surface,
            patient.wounds_film,
            hazards=HazardVolumes({"sphenopalatine artery": volume}),
            gravity=DOWN,
        )
        film.advance(0.0)
        edit = patient.carve(
            capsule((15, 15, 9.2), (16, 15, 9.2), 1.6), CuttingLimits()
        )
        assert edit is not None
        film.after_edit(edit.change)
        film.advance(2.0)
        rates.append(film.books.bled.copy())
        assert len(film.arteries) == (gap < 5)
        again = edit.change
        film.after_edit(again)
        assert len(film._sources.voxel) == len(set(film._sources.voxel.tolist()))
    assert rates[0][blood.ARTERY] == 0
    assert rates[1][blood.ARTERY] > 10 * rates[0].sum()


def test_the_cut_surface_bleeds_what_its_area_asks_for() -> None:
    """Over many cuts: a share of cells bleeds for all. Area of half a capsule."""
    count = 100, 60, 40
    patient = patient_of(lambda x, y, z: 9.2 - z + 0 * (x + y), count)
    film = film_of(patient)
    edit = patient.carve(capsule((8, 15, 9.2), (42, 15, 9.2), 3.0), CuttingLimits())
    assert edit is not None
    film.after_edit(edit.change)
    film.advance(1.0)
    area_cm2 = (math.pi * 3.0 * 34 + 2 * math.pi * 9.0) / 100
    rate = blood.RATES[blood.MUCOSA]
    tau = rate.tau_s
    law = rate.rate / 60 * area_cm2 / (1 + 1 / tau)
    assert film.books.bled_ml == pytest.approx(law, rel=0.2)


def test_blood_outside_the_nose_is_booked() -> None:
    count = 60, 40, 60
    surface = head(slope(50.0, 0.0, count), count)
    labels = np.full(surface.distance.shape, Label.NASAL_AIR, np.uint8)
    labels[:, :, 45:] = Label.NASOPHARYNX_AIR
    film = BloodFilm(
        OperatedPatient(surface, None).surface,
        np.zeros(surface.distance.shape, np.uint8),
        labels=surface.distance.with_values(labels, 0.0),
        gravity=DOWN,
    )
    film.advance(0.0)
    pour(film, H * np.array(count) / 2, 4.0)
    film.advance(10.0)
    assert film.books.left[2] > 0
    assert film.books.left[3] == 0
    assert unaccounted(film) == 0


def test_undoing_a_cut_leaves_its_blood() -> None:
    patient = patient_of(cave, CAVE)
    film = film_of(patient)
    edit = patient.carve(capsule((12, 12, 15), (12, 12, 14.5), 1.4), CuttingLimits())
    assert edit is not None
    film.after_edit(edit.change)
    film.advance(5.0)
    bled = film.books.bled.sum()
    assert bled > 0
    change = patient.undo()
    assert change is not None
    film.after_edit(change)
    assert film.books.bled.sum() == bled
    assert len(film._sources.voxel) == 0
    film.advance(10.0)
    assert film.books.bled.sum() == bled
    assert unaccounted(film) == 0


def test_what_is_drawn_is_the_thickness_and_is_told() -> None:
    """On a level floor every voxel next to the surface has the film's thickness."""
    count = 40, 40, 24
    patient = patient_of(lambda x, y, z: 5.2 - z + 0 * (x + y), count)
    film = film_of(patient)
    pour(film, (10.0, 10.0, 5.5), 30.0)
    assert film.drawn_box() is None
    film.advance(20.0)
    box = film.drawn_box()
    assert box is not None
    low, high = box
    drawn = patient.wounds_film
    outside = np.ones(drawn.shape, bool)
    outside[tuple(slice(low[a], high[a] + 1) for a in (2, 1, 0))] = False
    assert not drawn[outside].any()
    voxels, thick = film.thickness
    middle = thick > 0.9 * thick.max()
    codes = drawn.reshape(-1)[voxels[middle]]
    assert np.abs(codes - thick[middle] / 0.01).max() <= 3
    assert film.drawn_box() is None
    film.suck(Suction(np.array([10.0, 10.0, 5.5]), 200.0, 1e5))
    film.advance(22.0)
    assert drawn.max() < codes.min()


@pytest.mark.parametrize(
    ("gravity", "bias"), [((0, 0, 0), 1.0), ((0, 0, math.nan), 1.0), (DOWN, -1.0)]
)
def test_what_makes_no_sense_is_refused(
    gravity: tuple[float, float, float], bias: float
) -> None:
    patient = patient_of(cave, CAVE)
    with pytest.raises(UserError):
        BloodFilm(
            patient.surface, patient.wounds_film, gravity=gravity, blood_bias=bias
        )
