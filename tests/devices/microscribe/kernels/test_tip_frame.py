"""Compiled counts and frames have the bits of the same lines, interpreted."""

from math import cos, inf, sin, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.kernels.tip_frame import continue_counts
from devices.microscribe.kinematics.arm import BETA_JOINT, FIELD
from devices.microscribe.kinematics.forward import ForwardKinematics
from devices.microscribe.kinematics.profiles import PROFILES, ArmProfile

_six = st.lists(st.integers(-200_000, 200_000), min_size=6, max_size=6)
_readings = st.lists(st.integers(0, FIELD - 1), min_size=6, max_size=6)
_axis = list[float]


def _turned(a: _axis, b: _axis, angle: float) -> tuple[_axis, _axis]:
    """Turn a towards b."""
    c, s = cos(angle), sin(angle)
    return (
        [c * u + s * v for u, v in zip(a, b, strict=True)],
        [c * v - s * u for u, v in zip(a, b, strict=True)],
    )


def _plain_frame(profile: ArmProfile, counts: list[int]) -> list[list[float]]:
    """Carry the axes from joint to joint, in plain floats."""
    geometry = profile.geometry
    x, y, z = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]
    p = [0.0, 0.0, 0.0]
    for i, count in enumerate(counts):
        a, d = float(geometry.a_mm[i]), float(geometry.d_mm[i])
        turn = profile.encoders.turn[i]
        p = [u + a * v for u, v in zip(p, x, strict=True)]
        y, z = _turned(y, z, float(geometry.alpha[i]))
        if i == BETA_JOINT and geometry.beta != 0.0:
            z, x = _turned(z, x, geometry.beta)
        if turn > 1:
            x, y = _turned(x, y, count % turn * (tau / turn))
        p = [u + d * v for u, v in zip(p, z, strict=True)]
    rows = [list(row) for row in zip(x, y, z, p, strict=True)]
    return [*rows, [0.0, 0.0, 0.0, 1.0]]


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
@given(counts=_six)
def test_a_frame_has_the_bits_of_plain_floats(
    profile: ArmProfile, counts: list[int]
) -> None:
    forward = ForwardKinematics(profile.geometry, profile.encoders)
    frame = forward.device_from_tip(np.array(counts))
    assert frame.tolist() == _plain_frame(profile, counts)


@given(_readings, _six, st.integers(0, 5000), st.sampled_from([2000, 4096, FIELD]))
def test_counts_continue_as_plain_integers_do(
    reading: list[int], last: list[int], ticks: int, window: int
) -> None:
    windows, fastest = [window] * 6, [0.01 * i for i in range(5)] + [inf]
    counts = np.empty(6, dtype=np.int64)
    plausible = continue_counts(
        np.array(reading),
        np.array(last),
        FIELD,
        np.array(windows),
        np.array(fastest),
        ticks,
        2,
        counts,
    )
    expected = True
    for i in range(6):
        step = (reading[i] - last[i] + FIELD // 2) % FIELD - FIELD // 2
        assert counts[i] == last[i] + step
        # within the window, too, the shorter way round counts
        shortest = (step + window // 2) % window - window // 2
        most = 2 if ticks == 0 else fastest[i] * ticks + 2
        expected &= (ticks == 0 and fastest[i] == inf) or abs(shortest) <= most
    assert plausible == expected


@given(_readings, st.integers(-(1 << 40), 1 << 40))
def test_a_wrap_is_one_count(reading: list[int], turns: int) -> None:
    """For every count and any number of turns before, one more is one more."""
    last = np.array(reading) + turns * FIELD
    counts = np.empty(6, dtype=np.int64)
    following = np.array([(count + 1) % FIELD for count in reading])
    windows, still = np.full(6, FIELD), np.zeros(6)
    assert continue_counts(following, last, FIELD, windows, still, 1, 1, counts)
    assert (counts == last + 1).all()
