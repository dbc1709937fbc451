import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices.registration.fiducial_fit import RegistrationError, RegistrationReason
from devices.registration.rigid_fit import fit_rigid
from devices.registration.surface_fit import Landmarks, refine

RADII = np.array([70.0, 90.0, 110.0])


class Ellipsoid:
    """A face-sized ellipsoid, distances to first order: solid inside, air outside."""

    def distance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        level = np.linalg.norm(points / RADII, axis=1) - 1.0
        slope = np.linalg.norm(points / RADII**2, axis=1) / (level + 1.0)
        distances: NDArray[np.float64] = -level / slope
        return distances

    def normal(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        gradient = points / RADII**2
        unit: NDArray[np.float64] = -gradient / np.linalg.norm(
            gradient, axis=1, keepdims=True
        )
        return unit


def _on_ellipsoid(count: int, seed: int) -> NDArray[np.float64]:
    """Draw points on the front of the ellipsoid."""
    way = np.random.default_rng(seed).normal(size=(count, 3))
    way[:, 1] = -np.abs(way[:, 1])
    points: NDArray[np.float64] = RADII * way / np.linalg.norm(way, axis=1)[:, None]
    return points


FIDUCIALS = _on_ellipsoid(5, 3)
TRUTH = np.eye(4)
TRUTH[:3, :3] = Rotation.from_rotvec([0.3, -0.2, 1.0]).as_matrix()
TRUTH[:3, 3] = (200.0, -30.0, 80.0)
TARGET = np.array([10.0, 20.0, 15.0])


def _into_device(points: NDArray[np.float64]) -> NDArray[np.float64]:
    back = np.linalg.inv(TRUTH)
    moved: NDArray[np.float64] = points @ back[:3, :3].T + back[:3, 3]
    return moved


def _landmarks(error_mm: float, seed: int) -> tuple[NDArray[np.float64], Landmarks]:
    noise = np.random.default_rng(seed).normal(size=FIDUCIALS.shape) * error_mm
    touched = _into_device(FIDUCIALS + noise)
    start, _ = fit_rigid(touched, FIDUCIALS, np.ones(5))
    weights = np.broadcast_to(np.eye(3) / max(error_mm, 0.01) ** 2, (5, 3, 3))
    return start, Landmarks(touched, FIDUCIALS, weights)


def _off(transform: NDArray[np.float64]) -> float:
    device = np.append(_into_device(TARGET[None])[0], 1.0)
    return float(np.linalg.norm((transform @ device)[:3] - TARGET))


def test_exact_measurements_are_left_alone() -> None:
    start, landmarks = _landmarks(0.0, 0)
    traced = _into_device(_on_ellipsoid(80, 1))
    found = refine(start, landmarks, traced, Ellipsoid(), 0.2)
    np.testing.assert_allclose(found.world_from_device, TRUTH, atol=1e-8)
    assert found.surface_rms_mm < 1e-8


def test_the_surface_corrects_poor_landmarks() -> None:
    before, after = [], []
    for seed in range(30):
        start, landmarks = _landmarks(0.8, seed)
        noise = np.random.default_rng(seed).normal(size=(120, 3)) * 0.1
        traced = _into_device(_on_ellipsoid(120, seed + 50) + noise)
        found = refine(start, landmarks, traced, Ellipsoid(), 0.1)
        before.append(_off(start))
        after.append(_off(found.world_from_device))
    gain = np.sqrt(np.mean(np.square(before)) / np.mean(np.square(after)))
    assert gain > 3.0


def test_a_lifted_stylus_is_outweighed() -> None:
    start, landmarks = _landmarks(0.2, 4)
    points = _on_ellipsoid(150, 9)
    clean = refine(start, landmarks, _into_device(points), Ellipsoid(), 0.1)
    points[:15] *= 1.0 + 6.0 / np.linalg.norm(points[:15], axis=1)[:, None]
    lifted = refine(start, landmarks, _into_device(points), Ellipsoid(), 0.1)
    assert _off(lifted.world_from_device) < _off(clean.world_from_device) + 0.1


def test_without_a_trace_the_covariances_alone_decide() -> None:
    start, landmarks = _landmarks(0.5, 8)
    none = np.zeros((0, 3))
    equal = refine(start, landmarks, none, None, 0.1)
    np.testing.assert_allclose(equal.world_from_device, start, atol=1e-7)
    weights = landmarks.weights * np.array([1.0, 2.0, 3.0, 4.0, 5.0])[:, None, None]
    uneven = Landmarks(landmarks.device_mm, landmarks.patient_mm, weights)
    found = refine(start, uneven, none, None, 0.1)
    horn, _ = fit_rigid(landmarks.device_mm, FIDUCIALS, np.arange(1.0, 6.0))
    np.testing.assert_allclose(found.world_from_device, horn, atol=1e-7)


def test_a_point_unsure_along_one_direction_is_not_believed_there() -> None:
    _, landmarks = _landmarks(0.0, 0)
    device = landmarks.device_mm.copy()
    device[0] += _into_device(np.array([[0.0, 0.0, 3.0]]))[0]
    device[0] -= _into_device(np.zeros((1, 3)))[0]
    weights = landmarks.weights.copy()
    weights[0] = np.diag([1e4, 1e4, 1e-6])
    found = refine(
        TRUTH, Landmarks(device, FIDUCIALS, weights), np.zeros((0, 3)), None, 0.1
    )
    np.testing.assert_allclose(found.world_from_device, TRUTH, atol=1e-6)


def test_poor_traces_are_refused() -> None:
    start, landmarks = _landmarks(0.2, 1)
    with pytest.raises(RegistrationError, match="30 are needed") as caught:
        refine(start, landmarks, _into_device(_on_ellipsoid(20, 1)), Ellipsoid(), 0.1)
    assert caught.value.reason is RegistrationReason.SURFACE
    elsewhere = _into_device(_on_ellipsoid(60, 1) * 1.1)
    with pytest.raises(RegistrationError, match="mm off the patient's surface"):
        refine(start, landmarks, elsewhere, Ellipsoid(), 0.1)
    with pytest.raises(ValueError, match="need the surface"):
        refine(start, landmarks, elsewhere, None, 0.1)
