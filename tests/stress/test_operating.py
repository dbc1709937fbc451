"""Torture a patient: nothing breaks, the books stay exact, memory stays bounded."""

import math
import tracemalloc
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray
from xxhash import xxh3_128_hexdigest

from renderers.scene import AirSurface, Volume
from scenarios.instruments.catalogue import INSTRUMENTS
from scenarios.operation import Operation
from surgery import patient as patients
from tests.scenarios.recorded_hand import (
    FLOOR_MM,
    Hand,
    assert_sound,
    operation_on,
    replayed,
)
from tests.surgery.heads import SHAPE, H, remaining, surface_of

FORCEPS, DEBRIDER = "straight forceps", "microdebrider"
SAMPLE_BYTES = 1500
"""One recorded sample takes no more: the test itself keeps them."""

MOST_GROWTH = 1 << 20
"""Bytes that may be left behind once everything that is kept is full."""


def corner() -> AirSurface:
    """Return a head whose air is one edge between three walls."""
    z, y, x = np.meshgrid(*(H * np.arange(n) for n in SHAPE), indexing="ij")
    walls = np.maximum(np.maximum(8.0 - x, 7.0 - y), FLOOR_MM - z)
    return surface_of(np.clip(walls, -6, 12).astype(np.float32))


def drawn(operation: Operation) -> str:
    """Hash all that is drawn and may change."""
    surface = operation.pushing.surface
    wounds, rest = surface.wounds, surface.rest
    assert wounds is not None
    assert wounds.pale is not None
    assert rest is not None
    volumes: list[Volume] = [surface.distance, wounds.pristine, wounds.film]
    volumes += [wounds.pale, rest.x, rest.y, rest.z]
    arrays = [*(each.values for each in volumes), rest.box]
    return " ".join(xxh3_128_hexdigest(array.tobytes()) for array in arrays)


@pytest.mark.parametrize(
    "name", ["microdebrider", "straight forceps", "injection needle"]
)
def test_samples_change_nothing_that_is_drawn(name: str) -> None:
    """Cuts, blood, dents and pallor are shown together, by whoever asks for it."""
    hand = Hand(operation_on(corner(), has_orbit=False), (9.0, 8.0, 11.0), (-1.0,) * 3)
    operation = hand.operation
    shown = drawn(operation)
    for n in range(40):
        hand.tip_mm = np.array((9.0, 8.0, 11.0)) - 0.15 * n
        hand.step(0.1, name=name, is_working=True, is_sucking=True, jaw=n % 2)
        assert drawn(operation) == shown
        if n % 13 == 12:
            operation.show()
            assert drawn(operation) != shown
            shown = drawn(operation)
            wounds, patient = operation.pushing.surface.wounds, operation.patient
            assert wounds is not None
            assert wounds.pale is not None
            np.testing.assert_array_equal(wounds.film.values, patient.wounds_film)
            np.testing.assert_array_equal(wounds.pale.values, patient.wounds_pale)
    kinds = {change.kind for change in operation.take_changes()}
    assert len(kinds) > 1
    shown = drawn(operation)
    hand.step(0.1, name=name, undone=1)
    assert drawn(operation) == shown


QUICK = "microdebrider", "straight forceps", "sickle knife"
EVERY = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
    for name in sorted(INSTRUMENTS)
]
"""One of each way to take tissue among the fast tests, the other tools among all."""


@pytest.mark.parametrize("name", EVERY)
def test_a_tool_pressed_into_a_corner(name: str) -> None:
    hand = Hand(
        operation_on(corner(), has_orbit=False), (9.0, 8.0, 11.0), (-1.0, -1.0, -1.0)
    )
    before = remaining(hand.operation.patient)
    for n in range(24):
        # deeper than anything gives way
        hand.tip_mm = np.array((9.0, 8.0, 11.0)) - 0.25 * n
        hand.step(
            name=name, is_working=True, is_sucking=True, jaw=n % 2, roll_deg=15.0 * n
        )
    assert_sound(hand.operation, before)
    again = replayed(hand.samples, corner(), has_orbit=False)
    assert again.patient.hash() == hand.operation.patient.hash()


@pytest.mark.parametrize("name", EVERY)
def test_a_tool_that_begins_deep_in_tissue(name: str) -> None:
    hand = Hand(operation_on(has_orbit=False), tip_mm=(12.0, 11.0, 2.0))
    before = remaining(hand.operation.patient)
    for n in range(20):
        hand.step(name=name, is_working=True, is_sucking=True, jaw=n % 2)
        hand.tip_mm = (12.0, 11.0, 2.0 + 0.5 * n)
    assert_sound(hand.operation, before)
    again = replayed(hand.samples, has_orbit=False)
    assert again.patient.hash() == hand.operation.patient.hash()


@pytest.mark.filterwarnings("ignore:invalid value")
def test_poses_that_are_none_among_others() -> None:
    rng = np.random.default_rng(13)
    hand = Hand()
    before = remaining(hand.operation.patient)
    hand.step(name=DEBRIDER, is_working=True, is_sucking=True)
    for n in range(35):
        place = rng.uniform((6, 6, 7), (18, 16, 12))
        toward = rng.normal(size=3)
        if n % 3 == 1:
            place[rng.integers(3)] = rng.choice([math.nan, math.inf, -math.inf])
        if n % 5 == 2:
            toward[rng.integers(3)] = math.nan
        hand.tip_mm, hand.pointing = place, toward
        hand.step(name=(DEBRIDER, FORCEPS, "curette")[n // 7 % 3], jaw=n % 2)
    assert_sound(hand.operation, before)
    assert hand.counts > 0
    assert replayed(hand.samples).patient.hash() == hand.operation.patient.hash()


@pytest.mark.parametrize(
    "rate_hz", [pytest.param(100.0, marks=pytest.mark.slow), 1000.0]
)
def test_jumps_at_ten_metres_a_second(rate_hz: float) -> None:
    hand = Hand(pointing=(1.0, 0.0, 0.0), tip_mm=(6.0, 4.0, FLOOR_MM + 1.0))
    before = remaining(hand.operation.patient)
    hand.step(name=DEBRIDER, roll_deg=180.0, is_working=True, is_sucking=True)
    for n in range(10):
        y = 4.0 + 1e4 / rate_hz * (n % 2)
        hand.tip_mm = (6.0, y, FLOOR_MM + 1.0)
        hand.step(1 / rate_hz)
    assert_sound(hand.operation, before)
    # each place is cut, none of the way between
    between = np.array([11.0, 9.0, FLOOR_MM - 0.25])
    assert hand.operation.patient.surface.distance.sample(between) > 0.2
    assert replayed(hand.samples).patient.hash() == hand.operation.patient.hash()


def taken(hand: Hand) -> None:
    """Take what the operation keeps for whoever shows it."""
    hand.operation.take_changes()
    hand.operation.take_edits()
    hand.operation.take_injuries()


def bite_places(hand: Hand, count: int, seed: int) -> None:
    """Bite anywhere; what was bitten is taken from the operation, as an app does."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        hand.tip_mm = rng.uniform((4, 4, 1), (20, 18, 14))
        hand.pointing = rng.normal(size=3)
        hand.bite(name=FORCEPS, is_sucking=True)
        taken(hand)


@pytest.mark.parametrize("count", [100, pytest.param(10_000, marks=pytest.mark.slow)])
def test_many_bites(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    # the ring of old values is full well before the end
    monkeypatch.setattr(patients, "UNDO_BYTES", 1 << 18)
    hand = Hand(operation_on(has_orbit=False))
    before = remaining(hand.operation.patient)
    bite_places(hand, count, 1)
    patient = hand.operation.patient
    assert_sound(hand.operation, before)
    assert patient._undo_bytes == sum(step.bytes for step in patient._undo)
    assert patient._undo_bytes <= 1 << 18
    assert len(patient._undo) < patient.edits
    again = replayed(hand.samples, has_orbit=False)
    assert again.patient.hash() == patient.hash()
    assert again.figures() == hand.operation.figures()
    # what is undone comes back to the count, as far as it is kept
    while patient.undo() is not None:
        assert before - remaining(patient) == patient.books.counts
    assert patient._undo_bytes == 0


@pytest.mark.parametrize(
    "seconds",
    [
        2,
        pytest.param(20, marks=pytest.mark.slow),
        pytest.param(600, marks=[pytest.mark.slow, pytest.mark.timeout(2400)]),
    ],
)
def test_debriding_for_minutes_needs_no_more_memory(
    seconds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(patients, "UNDO_BYTES", 1 << 19)
    hand = Hand(operation_on(has_orbit=False), pointing=(1.0, 0.0, 0.0))
    before = remaining(hand.operation.patient)
    third = partial(debride, hand, round(seconds * 100 / 3))
    third(0)
    kept: list[int] = []
    hashes: list[str] = []
    tracemalloc.start()
    for _ in range(2):
        # the same way again: nothing is left to be cut, blood runs on
        samples, hand.samples = hand.samples, []
        kept.append(tracemalloc.get_traced_memory()[0])
        third(0)
        hand.samples = samples + hand.samples
        hashes.append(hand.operation.patient.hash())
    kept.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert_sound(hand.operation, before)
    assert hashes[0] == hashes[1]
    assert kept[2] - kept[1] < MOST_GROWTH + SAMPLE_BYTES * round(seconds * 100 / 3)
    assert replayed(hand.samples, has_orbit=False).patient.hash() == hashes[1]


def debride(hand: Hand, count: int, begin: int) -> None:
    """Shave to and fro at 100 Hz on a way that closes."""
    for n in range(begin, begin + count):
        turn = 2 * math.pi * n / 500
        hand.tip_mm = _way(turn)
        hand.step(name=DEBRIDER, roll_deg=180.0, is_working=True, is_sucking=True)
        taken(hand)


def _way(turn: float) -> NDArray[np.float64]:
    x, y = 7.0 + 3.0 * math.sin(turn), 11.0 + 6.0 * math.sin(2.0 * turn)
    return np.array([x, y, FLOOR_MM - 0.5 + math.cos(turn)])
