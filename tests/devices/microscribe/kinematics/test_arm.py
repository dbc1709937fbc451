"""Reference poses of a real arm's constants, worked out in float64."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.spatial.transform import Rotation

from devices.microscribe.kinematics.arm import Encoders, TipChange
from devices.microscribe.kinematics.profiles import (
    DX40937,
    NOMINAL,
    SECOND_3DX,
    ArmProfile,
)
from devices.microscribe.wire.packets import decode_packet

A = "83 00 6C 4F 30 5E 35 54 20 02 18 79 41 60"
VECTORS = [
    (DX40937, A, (54.196618, -51.842714, 212.200470), (0.168424, 0.483211, -54.720201)),
    (
        DX40937,
        "83 00" + " 00" * 12,
        (298.376338, 12.842208, -157.924572),
        (-0.170288, 0.000028, 0.016479),
    ),
    (
        DX40937,
        "83 00 10 00 20 00 08 00 04 00 08 00 00 00",
        (131.796064, 31.601920, 697.587172),
        (135.034126, 45.007852, -135.160317),
    ),
    (
        DX40937,
        "83 00 10 00 20 00 48 00 64 00 48 00 41 60",
        (131.796064, 31.601920, 697.587172),
        (135.034126, 45.007852, -135.160317),
    ),
    (
        DX40937,
        "83 00 7F 7F 2A 55 36 58 1F 7F 17 38 41 60",
        (57.039976, 13.481355, 227.754333),
        (-0.149648, 28.717977, -0.260591),
    ),
    (
        DX40937,
        "83 00 00 00 2A 55 36 58 00 00 17 38 41 60",
        (57.030768, 13.724787, 227.742432),
        (-0.056985, 28.717989, -0.227572),
    ),
    (
        SECOND_3DX,
        A,
        (54.935478, -51.516733, 212.420602),
        (0.017601, 0.483592, -54.591226),
    ),
    (NOMINAL, A, (54.767791, -51.708968, 212.024582), (0.172488, 0.483447, -54.546601)),
]


@pytest.mark.parametrize(("profile", "packet", "tip", "xyz_fixed"), VECTORS)
def test_reference_poses(
    profile: ArmProfile,
    packet: str,
    tip: tuple[float, ...],
    xyz_fixed: tuple[float, ...],
) -> None:
    counts = np.array(decode_packet(bytes.fromhex(packet)).counts)
    t = profile.geometry.device_from_tip(profile.encoders.angles(counts))
    np.testing.assert_allclose(t[:3, 3], tip, atol=1e-6)
    roll = np.arctan2(t[2, 1], t[2, 2])
    pitch = np.arctan2(-t[2, 0], np.hypot(t[0, 0], t[1, 0]))
    yaw = np.arctan2(t[1, 0], t[0, 0])
    np.testing.assert_allclose(np.degrees((roll, pitch, yaw)), xyz_fixed, atol=1e-6)


def test_joints_of_the_rest_pose_stand_where_the_links_put_them() -> None:
    angles = DX40937.encoders.angles(np.array(DX40937.home_counts))
    origins = DX40937.geometry.frames(angles)[:, :3, 3]
    expected = [
        (0, 0, 210.82),
        (32.3139, -6.9090, 210.7965),
        (-78.1862, 148.5410, 388.2409),
        (56.4295, -41.6387, 356.2490),
        (48.6744, -44.7194, 346.2402),
    ]
    np.testing.assert_allclose(origins[:5], expected, atol=1e-4)


def test_sixth_encoder_turns_the_tip_frame_about_its_axis() -> None:
    angles = DX40937.encoders.angles(np.array(DX40937.home_counts))
    still = DX40937.geometry.device_from_tip(angles)
    angles[5] = np.pi / 2.0
    turned = DX40937.geometry.device_from_tip(angles)
    np.testing.assert_allclose(turned[:, 2:], still[:, 2:], atol=1e-12)
    np.testing.assert_allclose(turned[:3, 0], still[:3, 1], atol=1e-12)


angles_strategy = arrays.arrays(np.float64, 6, elements=st.floats(-10.0, 10.0))


@given(angles_strategy)
def test_poses_are_rigid_and_batches_agree(angles: np.ndarray) -> None:
    t = DX40937.geometry.device_from_tip(angles)
    np.testing.assert_allclose(t[:3, :3] @ t[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(t[:3, :3]) == pytest.approx(1.0)
    batch = DX40937.geometry.device_from_tip(np.stack((angles, angles)))
    np.testing.assert_allclose(batch[1], t, atol=1e-12)


@given(arrays.arrays(np.int64, 6, elements=st.integers(0, 16383)))
def test_reach_is_bounded_by_the_links(counts: np.ndarray) -> None:
    t = DX40937.geometry.device_from_tip(DX40937.encoders.angles(counts))
    assert np.linalg.norm(t[:3, 3] - (0.0, 0.0, 210.82)) < 657.0


@given(arrays.arrays(np.int64, 6, elements=st.integers(-(10**6), 10**6)))
def test_whole_turns_do_not_matter(counts: np.ndarray) -> None:
    encoders = DX40937.encoders
    turned = counts + 3 * np.array(encoders.turn)
    assert np.array_equal(encoders.angles(counts), encoders.angles(turned))


@given(arrays.arrays(np.int64, 6, elements=st.integers(-50000, 50000)))
def test_counts_invert_angles(counts: np.ndarray) -> None:
    encoders = Encoders((16384, 16384, 8192, 4096, 4096, 2000))
    angles = counts * (2.0 * np.pi / np.array(encoders.turn))
    assert np.array_equal(encoders.counts(angles), counts)


def test_tips_change_the_length_of_the_stylus() -> None:
    angles = DX40937.encoders.angles(np.array(DX40937.home_counts))
    point = DX40937.geometry.device_from_tip(angles)
    ball = DX40937.geometry.with_tip(TipChange(longer_mm=-6.1468)).device_from_tip(
        angles
    )
    np.testing.assert_allclose(
        ball[:3, 3] - point[:3, 3], 6.1468 * point[:3, 2], atol=1e-9
    )
    longer = DX40937.geometry.with_tip(TipChange(10.0)).device_from_tip(angles)
    np.testing.assert_allclose(
        longer[:3, 3] - point[:3, 3], -10.0 * point[:3, 2], atol=1e-9
    )


def test_rounding_to_counts_costs_a_tenth_of_a_millimetre() -> None:
    rng = np.random.default_rng(1)
    angles = rng.uniform(0.0, 2.0 * np.pi, (4000, 6))
    angles[:, 5] = 0.0
    encoders = DX40937.encoders
    rounded = encoders.angles(encoders.counts(angles))
    exact = DX40937.geometry.device_from_tip(angles)[:, :3, 3]
    error = np.linalg.norm(
        DX40937.geometry.device_from_tip(rounded)[:, :3, 3] - exact, axis=1
    )
    assert np.sqrt(np.mean(error**2)) == pytest.approx(0.106, abs=0.006)
    assert error.max() < 0.35


def test_a_chain_of_quaternions_comes_to_the_same_pose() -> None:
    # Written with scipy's rotations and plain sums: no matrix of ours takes part.
    geometry = SECOND_3DX.geometry
    rng = np.random.default_rng(4)
    for angles in rng.uniform(0.0, 2.0 * np.pi, (200, 6)):
        turn, at = Rotation.identity(), np.zeros(3)
        for i in range(6):
            at = at + turn.apply((geometry.a_mm[i], 0.0, 0.0))
            turn = turn * Rotation.from_rotvec((geometry.alpha[i], 0.0, 0.0))
            if i == 2:
                turn = turn * Rotation.from_rotvec((0.0, geometry.beta, 0.0))
            turn = turn * Rotation.from_rotvec((0.0, 0.0, angles[i]))
            at = at + turn.apply((0.0, 0.0, geometry.d_mm[i]))
        found = geometry.device_from_tip(angles)
        np.testing.assert_allclose(found[:3, 3], at, atol=1e-9)
        np.testing.assert_allclose(found[:3, :3], turn.as_matrix(), atol=1e-12)


@pytest.mark.slow
def test_a_million_poses_are_finite_with_unit_axes() -> None:
    rng = np.random.default_rng(8)
    for _ in range(20):
        angles = rng.uniform(-100.0, 100.0, (50_000, 6))
        frames = DX40937.geometry.device_from_tip(angles)
        assert np.isfinite(frames).all()
        length = np.linalg.norm(frames[:, :3, 2], axis=1)
        assert np.abs(length - 1.0).max() < 1e-12
