import numpy as np
import pytest
from numpy.typing import NDArray

from devices.recording.probe_path import ProbePath
from devices.registration.rehearsal import HALF_CONE_DEG, HOLD_S, TURN_S, Hand, rehearse

LANDMARKS = np.array(
    [[1.0, -14.0, 50.0], [-40.0, -2.0, 18.0], [43.0, -4.0, 24.0], [2.0, -16.0, -24.0]]
)
CALM = Hand(tremor_mm=0.0, seat_mm=0.0)


def _presses(path: ProbePath) -> list[NDArray[np.intp]]:
    """Return the sample numbers of each press of the pedal."""
    down = np.flatnonzero(path.buttons)
    return np.split(down, np.flatnonzero(np.diff(down) > 1) + 1)


def test_a_calm_hand_does_exactly_what_it_should() -> None:
    traced = np.stack(
        [np.linspace(-30.0, 30.0, 40), np.zeros(40), np.full(40, 30.0)], 1
    )
    path = rehearse(LANDMARKS, pivot_mm=LANDMARKS[0], traced_mm=traced, hand=CALM)
    presses = _presses(path)
    assert len(presses) == 1 + len(LANDMARKS) + 1
    turn, *touches, trace = presses
    np.testing.assert_allclose(path.tip_mm[turn], np.tile(LANDMARKS[0], (len(turn), 1)))
    tilt = np.degrees(np.arccos(path.axis[turn] @ (0.0, 1.0, 0.0)))
    assert tilt.max() == pytest.approx(HALF_CONE_DEG, abs=0.5)
    assert path.t_s[turn[-1]] - path.t_s[turn[0]] == pytest.approx(TURN_S, abs=0.1)
    for press, landmark in zip(touches, LANDMARKS, strict=True):
        held_s = path.t_s[press[-1]] - path.t_s[press[0]]
        assert held_s == pytest.approx(HOLD_S, abs=0.05)
        np.testing.assert_allclose(path.tip_mm[press] - landmark, 0.0, atol=1e-12)
    np.testing.assert_allclose(path.tip_mm[trace][:, 1:] - (0.0, 30.0), 0.0, atol=1e-12)


def test_nothing_but_the_landmarks_when_nothing_else_is_wanted() -> None:
    assert len(_presses(rehearse(LANDMARKS))) == len(LANDMARKS)


def test_the_hand_errs_as_it_was_told() -> None:
    seats, shakes = [], []
    for seed in range(60):
        path = rehearse(LANDMARKS, hand=Hand(0.1, 0.3), seed=seed)
        for press, landmark in zip(_presses(path), LANDMARKS, strict=True):
            tips = path.tip_mm[press]
            seats.append(np.sum((tips.mean(axis=0) - landmark) ** 2))
            shakes.append(np.mean(np.sum((tips - tips.mean(axis=0)) ** 2, axis=1)))
    assert np.sqrt(np.mean(seats)) == pytest.approx(0.3, rel=0.1)
    assert np.sqrt(np.mean(shakes)) == pytest.approx(0.1, rel=0.1)


def test_no_joint_of_the_way_is_hurried() -> None:
    path = rehearse(LANDMARKS, pivot_mm=LANDMARKS[0])
    speed = np.linalg.norm(np.diff(path.tip_mm, axis=0), axis=1) / np.diff(path.t_s)
    assert speed.max() < 400.0
    turn = np.sum(path.axis[1:] * path.axis[:-1], axis=1)
    rate = np.degrees(np.arccos(np.clip(turn, -1.0, 1.0))) / np.diff(path.t_s)
    assert rate.max() < 240.0


def test_a_seed_repeats_the_hand() -> None:
    same = [rehearse(LANDMARKS, seed=3).tip_mm for _ in range(2)]
    np.testing.assert_array_equal(same[0], same[1])
    assert not np.array_equal(same[0], rehearse(LANDMARKS, seed=4).tip_mm)
