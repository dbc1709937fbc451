"""A compiled frame has the bits of the same lines, interpreted."""

from math import cos, sin, tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.kinematics.arm import BETA_JOINT
from devices.microscribe.kinematics.forward import ForwardKinematics
from devices.microscribe.kinematics.profiles import PROFILES, ArmProfile

_six = st.lists(st.integers(-200_000, 200_000), min_size=6, max_size=6)
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
