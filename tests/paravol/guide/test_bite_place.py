"""Where to bite next: much of what is wanted, little of the rest, no hazard near."""

import math

import numpy as np
import pytest

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from anatomy.tissue import Label
from paravol.guide.bite_place import KEPT_MM, bite_place
from renderers.scene import Volume

H = 0.5
SIZE = 60
NOSTRIL = np.array([15.0, 0.0, 15.0])
EYE = np.array([15.0, 4.0, 15.0])


def volume(values: np.ndarray, background: float = 0.0) -> Volume:
    return Volume(values, np.full(3, H), np.zeros(3), background=background)


def wall() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A wall across y with two blocks of uncinate in it; its air, labels, places."""
    y = np.arange(SIZE) * H
    distance = np.broadcast_to((y - 20.0)[:, None], (SIZE, SIZE, SIZE)).copy()
    labels = np.full(distance.shape, Label.MUCOSA, np.uint8)
    blocks = [(slice(24, 36), slice(40, 46), slice(at, at + 6)) for at in (10, 40)]
    for block in blocks:
        labels[block] = Label.UNCINATE
    k, j, i = np.nonzero(labels == Label.UNCINATE)
    return distance.astype(np.float32), labels, np.stack([i, j, k], axis=1) * H


def where(
    distance: np.ndarray,
    labels: np.ndarray,
    places: np.ndarray,
    tip: tuple[float, float, float] = (15.0, 18.0, 15.0),
    **rest: object,
) -> np.ndarray:
    found = bite_place(
        volume(distance, -9.0),
        volume(labels),
        places,
        np.array(tip),
        EYE,
        NOSTRIL,
        **rest,  # type: ignore[arg-type]
    )
    assert found is not None
    return found[0]


@pytest.mark.parametrize("side", [0, 1])
def test_a_bite_spares_what_lies_beside(side: int) -> None:
    distance, labels, places = wall()
    for low in (2, 16) if side == 0 else (32, 46):
        labels[24:36, 40:46, low : low + 8] = Label.MIDDLE_TURBINATE
    spared = where(distance, labels, places, spared=("middle turbinate",))
    assert (spared[0] > 15.0) == (side == 0)


def test_hazards_are_kept_off_as_long_as_there_is_another_place() -> None:
    distance, labels, places = wall()
    x = np.broadcast_to(np.arange(SIZE) * H, distance.shape)
    gap = np.rint((x - 9.0) / UNIT_MM).astype(np.int16)
    hazards = HazardVolumes({"orbit": volume(gap, 30000.0)})
    for tip_x in (6.0, 24.0):
        tip = (tip_x, 18.0, 15.0)
        place = where(distance, labels, places, tip, hazards=hazards)
        assert place[0] - 9.0 > KEPT_MM
    left = places[places[:, 0] < 9.0]
    assert where(distance, labels, left, hazards=hazards)[0] < 9.0


@pytest.mark.parametrize("side", [0, 1])
def test_what_no_straight_tool_comes_to_is_bitten_later(side: int) -> None:
    distance, labels, places = wall()
    half = slice(0, 30) if side == 0 else slice(30, SIZE)
    distance[:, 26:30, half] = 3.0
    place = where(distance, labels, places)
    assert (place[0] > 15.0) == (side == 0)


def test_it_lies_at_air_and_in_what_is_left() -> None:
    distance, labels, places = wall()
    distance[:, 40:42] = -1.0
    place = where(distance, labels, places)
    assert place[1] >= 21.0
    assert (
        bite_place(
            volume(np.full_like(distance, -1.0), -9.0),
            volume(labels),
            places,
            EYE,
            EYE,
            NOSTRIL,
        )
        is None
    )


@pytest.mark.parametrize("best", [6.0, 21.0])
def test_a_tool_in_hand_is_sent_where_it_is_worth_most(best: float) -> None:
    distance, labels, places = wall()

    def grip(some: np.ndarray) -> np.ndarray:
        return np.maximum(3.0 - np.abs(some[:, 0] - best), 0.0)

    place = where(distance, labels, places, grip=grip)
    assert abs(place[0] - best) < 3.0


def test_where_a_tool_is_worth_nothing_it_is_told() -> None:
    distance, labels, places = wall()
    seen = volume(distance, -9.0), volume(labels), places, EYE, EYE, NOSTRIL
    found = bite_place(*seen, grip=lambda some: np.zeros(len(some)))
    assert found is not None
    assert found.worth == 0.0
    plain = bite_place(*seen)
    assert plain is not None
    assert plain.worth == math.inf
    assert (plain.place_mm == found.place_mm).all()


@pytest.mark.parametrize(("kept", "stays"), [(6.0, True), (21.0, True), (15.0, False)])
def test_who_is_on_the_way_is_not_sent_elsewhere_for_little(
    kept: float, stays: bool
) -> None:
    """Both blocks are worth much; between them there is nothing to bite."""
    distance, labels, places = wall()

    def grip(some: np.ndarray) -> np.ndarray:
        return np.where(some[:, 0] < 12.0, 10.0, 8.0)

    kept_mm = np.array([kept, 20.5, 15.0])
    place = where(distance, labels, places, grip=grip, kept_mm=kept_mm)
    assert (np.linalg.norm(place - kept_mm) < 1e-9) == stays


def test_a_better_place_is_worth_the_way() -> None:
    distance, labels, places = wall()

    def grip(some: np.ndarray) -> np.ndarray:
        return np.where(some[:, 0] < 12.0, 10.0, 2.0)

    kept_mm = np.array([21.0, 20.5, 15.0])
    assert where(distance, labels, places, grip=grip, kept_mm=kept_mm)[0] < 12.0
