import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.controls.roll import EncoderRoll, HorizonRoll, SecondDeviceRoll, upright
from devices.microscribe.kinematics.profiles import DX40937
from devices.pose import Pose


def _pose(frame: NDArray[np.float64] | None = None, at_s: float = 0.0) -> Pose:
    return Pose(at_s, at_s, np.eye(4) if frame is None else frame, 0)


def _frame(pointing: NDArray[np.float64], roll_deg: float) -> NDArray[np.float64]:
    """Return the frame of a scope whose x axis is its light post."""
    up = upright(pointing)
    turn = Rotation.from_rotvec(math.radians(roll_deg) * pointing)
    x = turn.apply(up)
    frame = np.eye(4)
    frame[:3, :3] = np.stack((x, np.cross(-pointing, x), -pointing), axis=1)
    return frame


def _unit(x: float, y: float, z: float) -> NDArray[np.float64]:
    vector = np.array([x, y, z])
    unit: NDArray[np.float64] = vector / np.linalg.norm(vector)
    return unit


POSTERIOR = _unit(0.1, 1.0, 0.3)
parts = st.floats(-1.0, 1.0)


@given(parts, parts, parts, st.floats(-180.0, 180.0), st.integers(0, 10**6))
def test_a_sixth_encoder_shows_the_roll_from_anywhere(
    x: float, y: float, z: float, roll: float, seed: int
) -> None:
    assume(np.linalg.norm((x, y, z)) > 0.1)
    world_from_device = np.eye(4)
    turn = Rotation.random(random_state=seed).as_matrix()
    world_from_device[:3, :3] = turn
    in_device = world_from_device.T @ _frame(_unit(x, y, z), roll)
    found = EncoderRoll(world_from_device).roll_deg(_pose(in_device))
    assert found is not None
    assert math.remainder(found - roll, 360.0) == pytest.approx(0.0, abs=1e-6)


def test_a_roll_runs_on_over_full_turns() -> None:
    source = EncoderRoll(np.eye(4))
    seen = [source.roll_deg(_pose(_frame(POSTERIOR, r))) for r in range(0, 730, 10)]
    np.testing.assert_allclose(
        np.array(seen, dtype=float), range(0, 730, 10), atol=1e-9
    )


def test_level_says_where_the_light_post_was() -> None:
    source = EncoderRoll(np.eye(4))
    source.level(_pose(_frame(POSTERIOR, 37.0)), at_deg=5.0)
    assert source.roll_deg(_pose(_frame(POSTERIOR, 37.0))) == pytest.approx(5.0)
    assert source.roll_deg(_pose(_frame(POSTERIOR, 47.0))) == pytest.approx(15.0)
    source.level(_pose(_frame(POSTERIOR, 47.0)))
    assert source.roll_deg(_pose(_frame(POSTERIOR, 47.0))) == pytest.approx(0.0)


def test_the_arm_s_sixth_joint_is_the_roll() -> None:
    angles = DX40937.encoders.angles(np.array(DX40937.home_counts))
    frames = []
    for degrees in (0.0, 25.0):
        angles[5] = math.radians(degrees)
        frames.append(DX40937.geometry.device_from_tip(angles))
    source = EncoderRoll(np.eye(4))
    source.level(_pose(frames[0]))
    # The joint turns about the axis that points back up the stylus.
    assert source.roll_deg(_pose(frames[1])) == pytest.approx(-25.0)


def test_upright_never_fails() -> None:
    for way in (_unit(0, 0, 1), _unit(0, 0, -1), _unit(1e-4, 0, 1), POSTERIOR):
        up = upright(way)
        assert np.linalg.norm(up) == pytest.approx(1.0)
        assert up @ way == pytest.approx(0.0, abs=1e-12)
    assert upright(_unit(0, 1, 0)) == pytest.approx([0, 0, 1])


def test_who_does_not_know_says_so() -> None:
    assert HorizonRoll().roll_deg(_pose()) == 0.0
    assert SecondDeviceRoll().roll_deg(_pose()) is None


def test_a_second_device_is_joined_by_time() -> None:
    second = SecondDeviceRoll()
    for i, degrees in enumerate((170.0, 178.0, -174.0)):
        second.put(0.02 * i, degrees)
    assert second.roll_deg(_pose(at_s=-0.01)) is None
    assert second.roll_deg(_pose(at_s=0.01)) == pytest.approx(174.0)
    assert second.roll_deg(_pose(at_s=0.03)) == pytest.approx(182.0)
    assert second.roll_deg(_pose(at_s=0.1)) == pytest.approx(186.0)
    assert second.roll_deg(_pose(at_s=0.2)) is None


def test_readings_come_in_order() -> None:
    second = SecondDeviceRoll()
    second.put(1.0, 0.0)
    with pytest.raises(ValueError, match="in order"):
        second.put(1.0, 5.0)
    with pytest.raises(ValueError, match="finite"):
        second.put(2.0, math.inf)
