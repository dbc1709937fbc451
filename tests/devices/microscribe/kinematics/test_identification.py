import numpy as np
import pytest
from numpy.typing import NDArray

from devices.microscribe.kinematics.error_model import BuiltArm
from devices.microscribe.kinematics.identification import UnidentifiableError, identify
from devices.microscribe.kinematics.jacobian import (
    PARAMETER_NAMES,
    PARAMETERS,
    parameter_jacobian,
)
from devices.microscribe.kinematics.profiles import DX40937, NOMINAL

# All constants of joints 0 to 4, less those of the base that no tip can show (the
# device's frame is where the base says it is) and one of the two parallel offsets.
FREE = (
    *(f"alpha {i}" for i in range(1, 5)),
    *(f"a {i}" for i in range(1, 5)),
    *(f"zero {i}" for i in range(5)),
    *(f"d {i}" for i in (0, 1, 3, 4)),
    "beta",
)


def _angles(count: int) -> NDArray[np.float64]:
    angles = np.random.default_rng(2).uniform(0.0, 2.0 * np.pi, (count, 6))
    angles[:, 5] = 0.0
    return angles


def _deviation(seed: int) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    deviation = np.zeros(PARAMETERS)
    for name in FREE:
        size = 0.5 if name[:2] in ("a ", "d ") else 2e-3
        deviation[PARAMETER_NAMES.index(name)] = size * rng.normal()
    return deviation


@pytest.mark.parametrize("seed", range(5))
def test_exact_places_give_the_constants_back(seed: int) -> None:
    angles, deviation = _angles(60), _deviation(seed)
    built = BuiltArm.deviating(DX40937.geometry, deviation)
    tips = built.device_from_tip(angles)[:, :3, 3]
    found = identify(DX40937.geometry, angles, tips, FREE)
    assert np.abs(found.deviation - deviation).max() < 1e-9
    assert found.residual_rms_mm < 1e-9
    assert found.smallest_singular > 0.01


def test_noise_averages_out() -> None:
    built = BuiltArm.deviating(DX40937.geometry, _deviation(1))
    fresh = _angles(400)[300:]
    errors = []
    for count in (40, 160):
        angles = _angles(count)
        tips = built.device_from_tip(angles)[:, :3, 3]
        noise = np.random.default_rng(4).normal(size=tips.shape) * 0.1
        found = identify(DX40937.geometry, angles, tips + noise, FREE)
        off = found.arm.device_from_tip(fresh) - built.device_from_tip(fresh)
        errors.append(float(np.sqrt(np.mean(np.sum(off[:, :3, 3] ** 2, axis=1)))))
    assert errors[1] < 0.1
    assert 1.4 < errors[0] / errors[1] < 3.0


def test_parallel_axes_hide_one_offset() -> None:
    names = [f"{key} {i}" for key in ("alpha", "a", "zero", "d") for i in range(5)]
    columns = [PARAMETER_NAMES.index(name) for name in names]
    angles = _angles(200)
    block = parameter_jacobian(NOMINAL.geometry, angles)[:, :3, columns].reshape(-1, 20)
    assert np.linalg.matrix_rank(block / np.linalg.norm(block, axis=0)) == 19
    tips = NOMINAL.geometry.device_from_tip(angles)[:, :3, 3]
    with pytest.raises(UnidentifiableError, match="d 1, d 2 apart"):
        identify(NOMINAL.geometry, angles, tips, names)


def test_mistakes_of_the_caller() -> None:
    angles = _angles(3)
    tips = np.zeros((3, 3))
    with pytest.raises(ValueError, match="name parameters"):
        identify(NOMINAL.geometry, angles, tips, ("gamma 1",))
    with pytest.raises(ValueError, match="at least 6 poses"):
        identify(NOMINAL.geometry, angles, tips, FREE)
