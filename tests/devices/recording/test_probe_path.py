from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.recording.probe_path import ProbePath, slerp
from system import UserError

_numbers = st.floats(-1.0, 1.0)


def _unit(seed: int) -> NDArray[np.float64]:
    vector = np.random.default_rng(seed).normal(size=3)
    unit: NDArray[np.float64] = vector / np.linalg.norm(vector)
    return unit


def test_samples_are_met_at_their_times(short_path: ProbePath) -> None:
    for i in (0, 17, 99, 100):
        sample = short_path.sample(float(short_path.t_s[i]))
        np.testing.assert_allclose(sample.tip_mm, short_path.tip_mm[i], atol=1e-12)
        np.testing.assert_allclose(sample.axis, short_path.axis[i], atol=1e-12)
        assert sample.roll_deg == pytest.approx(short_path.roll_deg[i], abs=1e-12)


def test_the_path_stands_still_outside_its_time(short_path: ProbePath) -> None:
    assert short_path.sample(-5.0).tip_mm.tolist() == short_path.tip_mm[0].tolist()
    assert short_path.sample(9.0).tip_mm.tolist() == short_path.tip_mm[-1].tolist()


def test_buttons_hold_until_the_next_sample(short_path: ProbePath) -> None:
    buttons = np.zeros(101, dtype=np.int64)
    buttons[50] = 3
    path = replace(short_path, buttons=buttons)
    assert [path.sample(t).buttons for t in (0.495, 0.505, 0.515)] == [0, 3, 0]


def test_interpolation_converges_with_the_square_of_the_interval() -> None:
    def error(count: int) -> float:
        t = np.linspace(0.0, 1.0, count)
        one, zero = np.ones(count), np.zeros(count)
        tip = np.stack((np.cos(t), np.sin(t), zero), axis=1)
        axis = np.stack((zero, one, zero), axis=1)
        path = ProbePath("arc", t, tip, axis, zero, tip, axis, zero.astype(np.int64))
        times = np.linspace(0.0, 1.0, 997)
        exact = np.stack((np.cos(times), np.sin(times), 0 * times), axis=1)
        got = np.array([path.sample(float(s)).tip_mm for s in times])
        return float(np.abs(got - exact).max())

    assert error(11) / error(21) == pytest.approx(4.0, rel=0.1)


@given(st.integers(0, 10**6), st.integers(0, 10**6), st.floats(0.0, 1.0))
def test_slerp_divides_the_angle(first: int, second: int, u: float) -> None:
    start, end = _unit(first), _unit(second)
    between = slerp(start, end, u)
    assert np.linalg.norm(between) == pytest.approx(1.0)
    whole = np.arccos(np.clip(start @ end, -1.0, 1.0))
    part = np.arccos(np.clip(start @ between, -1.0, 1.0))
    assert part == pytest.approx(u * whole, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": ""}, "needs a name"),
        ({"t_s": np.zeros(101)}, "rise strictly"),
        ({"t_s": np.linspace(1.0, 2.0, 101)}, "rise strictly from 0"),
        ({"tip_mm": np.zeros((100, 3))}, "tip_mm must have shape"),
        ({"tip_mm": np.full((101, 3), np.inf)}, "tip_mm must be finite"),
        ({"axis": np.ones((101, 3))}, "sample 0 has length 1.73"),
        ({"roll_deg": np.arange(101) % 2 * 180.0}, "jumps by 180"),
        ({"buttons": np.full(101, 128)}, r"0\.\.127"),
    ],
)
def test_bad_paths_are_refused_by_name(
    short_path: ProbePath, change: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        replace(short_path, **change)


def test_length_and_duration(short_path: ProbePath) -> None:
    assert short_path.duration_s == 1.0
    straight = np.outer(np.linspace(0.0, 1.0, 101), (3.0, 4.0, 0.0))
    assert replace(short_path, tip_mm=straight).length_mm == pytest.approx(5.0)


def test_jaws_and_turns_are_checked(short_path: ProbePath) -> None:
    """A path that names no tool says so; an empty hand is another thing."""
    assert short_path.sample(0.5).tool is None
    assert replace(short_path, tools=((0.0, ""),)).sample(0.5).tool == ""
    for wrong in (
        {"jaw": np.full(101, 1.1)},
        {"instrument_roll_deg": np.full(101, np.nan)},
        {"scopes": ((1.0, 70.0), (0.5, None))},
    ):
        with pytest.raises(UserError):
            replace(short_path, **wrong)
