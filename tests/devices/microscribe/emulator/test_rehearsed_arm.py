import numpy as np
from numpy.typing import NDArray

from devices.microscribe.emulator.script import RehearsedArm
from devices.microscribe.kinematics.error_model import KinematicErrorModel
from devices.microscribe.kinematics.jacobian import PARAMETERS
from devices.microscribe.kinematics.profiles import DX40937
from devices.microscribe.kinematics.uncertainty import ParameterSpread
from devices.recording.probe_path import ProbePath

HOME = DX40937.encoders.angles(np.array(DX40937.home_counts))
HOME[5] = 0.0
GEOMETRY = DX40937.geometry
BEGUN_S = 50.0


def _path() -> ProbePath:
    """A little swing of the arm about its rest."""
    t_s = np.arange(0.0, 1.0, 0.02)
    swing = 0.1 * np.sin(2.0 * np.pi * t_s)[:, None] * (1.0, 1.0, 1.0, 1.0, 1.0, 0.0)
    frames = GEOMETRY.device_from_tip(HOME + swing)
    return ProbePath(
        name="swing",
        t_s=t_s,
        tip_mm=frames[:, :3, 3],
        axis=-frames[:, :3, 2],
        roll_deg=np.zeros(len(t_s)),
        instrument_tip_mm=frames[:, :3, 3],
        instrument_axis=-frames[:, :3, 2],
        buttons=(t_s >= 0.5).astype(np.int64),
    )


def _arm(deviation: NDArray[np.float64]) -> RehearsedArm:
    built = KinematicErrorModel.deviating(GEOMETRY, deviation)
    arm = RehearsedArm(DX40937, built, _path(), np.eye(4))
    arm.begin(BEGUN_S)
    arm.begin(BEGUN_S + 7.0)
    return arm


def _tip(counts: tuple[int, ...]) -> NDArray[np.float64]:
    angles = DX40937.encoders.angles(np.array(counts))
    found: NDArray[np.float64] = GEOMETRY.device_from_tip(angles)[:3, 3]
    return found


def test_an_exact_arm_follows_the_path_to_the_count() -> None:
    arm, path = _arm(np.zeros(PARAMETERS)), _path()
    for i, t_s in enumerate(path.t_s):
        counts, pedals = arm.latch(BEGUN_S + float(t_s))
        assert np.linalg.norm(_tip(counts) - path.tip_mm[i]) < 0.3
        assert counts[5] == DX40937.home_counts[5]
        # Adding and taking away the start may round to the sample before.
        assert pedals in (path.buttons[i], path.buttons[max(i - 1, 0)])


def test_a_built_arm_is_believed_elsewhere_but_truly_on_the_path() -> None:
    deviation = ParameterSpread(0.2, 2e-3, 2e-3).draw(np.random.default_rng(2))
    arm, path = _arm(deviation), _path()
    built = KinematicErrorModel.deviating(GEOMETRY, deviation)
    angles = np.array(arm.track.at(float(path.t_s[20]))[0])
    truly = built.device_from_tip(angles)[:3, 3]
    np.testing.assert_allclose(truly, path.tip_mm[20], atol=1e-6)
    believed = GEOMETRY.device_from_tip(angles)[:3, 3]
    assert np.linalg.norm(believed - path.tip_mm[20]) > 0.1


def test_after_the_path_the_arm_stands_still() -> None:
    arm = _arm(np.zeros(PARAMETERS))
    assert arm.latch(BEGUN_S + 60.0) == arm.latch(BEGUN_S + 90.0)
