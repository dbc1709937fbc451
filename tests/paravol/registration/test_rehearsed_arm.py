import numpy as np
import pytest
from numpy.typing import NDArray

from devices.microscribe.kinematics.uncertainty import EXACT, ParameterSpread
from devices.registration.registration_file import RegistrationRecord
from devices.registration.rehearsal import rehearse
from paravol.registration.rehearsed_arm import (
    LONGER_TIP_MM,
    RehearsedTruth,
    rehearsed_arm,
    rehearsed_truth,
)

LANDMARKS = np.array(
    [[1.0, -14.0, 50.0], [-40.0, -2.0, 18.0], [43.0, -4.0, 24.0], [2.0, -16.0, -24.0]]
)
TARGETS = {"ostium": np.array([13.0, 27.4, 23.2])}
PATH = rehearse(LANDMARKS)


def _record(
    world_from_device: NDArray[np.float64], tip_z_mm: float
) -> RegistrationRecord:
    return RegistrationRecord(
        world_from_device=tuple(world_from_device.ravel().tolist()),
        tip_mm=(0.0, 0.0, tip_z_mm),
        arm_serial="EMU00001",
        arm_model="DX",
        head="none",
        created="2000-01-01T00:00:00+00:00",
        landmarks=(),
        residual_rms_mm=0.0,
        traced_points=0,
        surface_rms_mm=0.0,
        targets={},
        budget_mm=0.75,
    )


def _inverse(transform: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.inv(transform), dtype=np.float64)


def _perfect(truth: RehearsedTruth, tip_z_mm: float = -LONGER_TIP_MM) -> float:
    record = _record(_inverse(truth.device_from_world), tip_z_mm)
    return truth.errors_mm(record, TARGETS)["ostium"]


def test_of_an_exact_arm_only_the_counts_remain() -> None:
    assert 0.02 < _perfect(rehearsed_truth(PATH, EXACT, 1)) < 0.2


def test_a_wrong_tip_and_a_wrong_place_show() -> None:
    truth = rehearsed_truth(PATH, EXACT, 1)
    assert _perfect(truth, 0.0) == pytest.approx(LONGER_TIP_MM, abs=0.2)
    moved = _inverse(truth.device_from_world)
    moved[:3, 3] += (3.0, 0.0, 4.0)
    error = truth.errors_mm(_record(moved, -LONGER_TIP_MM), TARGETS)["ostium"]
    assert error == pytest.approx(5.0, abs=0.3)


def test_an_arm_of_metal_errs_more() -> None:
    errors = [_perfect(rehearsed_truth(PATH, ParameterSpread(), s)) for s in range(4)]
    assert np.sqrt(np.mean(np.square(errors))) > 0.15


def test_the_driver_reads_the_rehearsed_arm() -> None:
    truth = rehearsed_truth(PATH, EXACT, 1)
    start = truth.device_from_world @ np.append(PATH.tip_mm[0], 1.0)
    with rehearsed_arm(truth, PATH) as arm:
        pose = arm.read(2.0)
        assert arm.description.identity.serial == truth.profile.identity.serial
    tip = pose.device_from_tip @ (0.0, 0.0, -LONGER_TIP_MM, 1.0)
    assert np.linalg.norm((tip - start)[:3]) < 1.0
