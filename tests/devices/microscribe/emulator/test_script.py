import numpy as np
import pytest
from numpy.typing import NDArray

from devices.microscribe.emulator.placement import place_arm
from devices.microscribe.emulator.script import (
    MARK_PEDAL,
    PATH_PEDAL,
    TREMOR_MM,
    ArmScript,
)
from devices.microscribe.kinematics.profiles import DX40937, HOME_COUNTS
from devices.recording.probe_path import ProbePath

FIDUCIALS = np.array([[0.0, -85, 45], [38, -60, 20], [-45, -52, 26], [5, -90, -25]])
SEED = 11


def _make(path: ProbePath) -> tuple[ArmScript, NDArray[np.float64]]:
    place = place_arm(DX40937, path, FIDUCIALS, SEED)
    return ArmScript(DX40937, path, place, FIDUCIALS, SEED), place


def _tip(counts: tuple[int, ...], place: NDArray[np.float64]) -> NDArray[np.float64]:
    angles = DX40937.encoders.angles(np.array(counts))
    tip = DX40937.geometry.device_from_tip(angles)
    world: NDArray[np.float64] = (np.linalg.inv(place) @ tip)[:3, 3]
    return world


def test_the_script_touches_the_fiducials_and_plays_the_path(
    short_path: ProbePath,
) -> None:
    script, place = _make(short_path)
    assert script.latch(3.0) == (HOME_COUNTS, 0)
    script.begin(5.0)
    now, presses, pressed = 5.0, [], []
    previous: NDArray[np.int64] | None = None
    path_began = None
    while True:
        counts, buttons = script.latch(now)
        array = np.array(counts)
        if previous is not None:
            step = (array - previous + 8192) % 16384 - 8192
            degrees = np.abs(step[:5]) / DX40937.encoders.turn[:5] * 360.0
            assert degrees.max() < 7.2, "faster than the driver's gate"
        previous = array
        if buttons & MARK_PEDAL:
            pressed.append(_tip(counts, place))
        elif pressed:
            presses.append(np.array(pressed))
            pressed = []
        if buttons & PATH_PEDAL:
            if path_began is None:
                path_began = now
            exact = short_path.sample(now - path_began).tip_mm
            assert np.linalg.norm(_tip(counts, place) - exact) < 0.35
        elif path_began is not None:
            break
        now += 0.01
    assert len(presses) == len(FIDUCIALS)
    for press, fiducial in zip(presses, FIDUCIALS, strict=True):
        assert 38 <= len(press) <= 42
        wander = np.linalg.norm(press - fiducial, axis=1)
        assert np.sqrt(np.mean(wander**2)) == pytest.approx(TREMOR_MM, abs=0.1)
    assert path_began is not None
    assert now - path_began == pytest.approx(short_path.duration_s, abs=0.02)


def test_path_time_is_zero_at_the_very_packet_that_shows_the_pedal(
    short_path: ProbePath,
) -> None:
    script, place = _make(short_path)
    script.begin(0.0)
    # However late somebody looks, the path begins with that look.
    counts, buttons = script.latch(1000.0)
    assert buttons & PATH_PEDAL
    np.testing.assert_allclose(_tip(counts, place), short_path.tip_mm[0], atol=0.35)
    # A pause of the polls leaps to where the path is by then.
    counts, buttons = script.latch(1000.9)
    assert buttons & PATH_PEDAL
    exact = short_path.sample(0.9).tip_mm
    np.testing.assert_allclose(_tip(counts, place), exact, atol=0.35)


def test_equal_seeds_give_equal_counts(short_path: ProbePath) -> None:
    first, second = _make(short_path)[0], _make(short_path)[0]
    first.begin(0.0)
    second.begin(0.0)
    for now in (0.2, 0.9, 1.4, 2.0):
        assert first.latch(now) == second.latch(now)
