"""Where the emulated arm's base stands beside the patient."""

import math

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.inverse import InverseKinematics, UnreachableError
from devices.microscribe.kinematics.profiles import ArmProfile
from devices.recording.probe_path import ProbePath
from system import UserError

# The patient lies on the back: posterior is down for the arm, the head's top points
# away from its base or sideways, as the seed has it.
SUPINE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])

# Tip's distance from the base axis and height above the table: the middle of what a
# stylus pointing down can reach.
REACH_MM = (200.0, 320.0)
HEIGHT_MM = (40.0, 180.0)
LARGEST_TILT_DEG = 10.0

# From the shoulder; the stretched arm ends at 656 mm and knows no direction there.
LARGEST_REACH_MM = 600.0

# Sine of the wrist's angle. Where stylus and forearm are in line joint 3 has to turn
# for ever smaller motions of the tip, and linkages of real arms bend most.
SMALLEST_WRIST = 0.3

CHECKED_SAMPLES = 120
ATTEMPTS = 50


def place_arm(
    profile: ArmProfile, path: ProbePath, fiducials_mm: NDArray[np.float64], seed: int
) -> NDArray[np.float64]:
    """Return a rigid device_from_world, (4, 4), from which all of ``path`` is reached.

    Raise UserError when fifty places of this seed do not suffice.
    """
    rng = np.random.default_rng(seed)
    times = np.linspace(0.0, path.duration_s, CHECKED_SAMPLES)
    samples = [path.sample(float(t)) for t in times]
    axes = np.array([sample.axis for sample in samples])
    tips = np.array([sample.tip_mm for sample in samples])
    targets = np.concatenate((fiducials_mm.reshape(-1, 3), tips))
    pointing = np.concatenate((np.repeat(axes[:1], len(fiducials_mm), axis=0), axes))
    for _ in range(ATTEMPTS):
        place = _draw(rng, tips.mean(axis=0))
        if _reaches(profile, place, targets, pointing, len(fiducials_mm) + 1):
            return place
    raise UserError(
        f"no place for the arm from which path {path.name!r} can be reached was found "
        f"with seed {seed}; try another seed or a shorter path"
    )


def _draw(
    rng: np.random.Generator, centre_mm: NDArray[np.float64]
) -> NDArray[np.float64]:
    azimuth, heading, lean = rng.uniform(0.0, 2.0 * np.pi, 3)
    tilt = math.radians(rng.uniform(0.0, LARGEST_TILT_DEG))
    radius, height = rng.uniform(*REACH_MM), rng.uniform(*HEIGHT_MM)
    across = np.array([np.cos(lean), np.sin(lean), 0.0])
    rotation = _turn(across, tilt) @ _turn(np.array([0.0, 0.0, 1.0]), heading) @ SUPINE
    place = np.eye(4)
    place[:3, :3] = rotation
    centre = np.array([radius * np.cos(azimuth), radius * np.sin(azimuth), height])
    place[:3, 3] = centre - rotation @ centre_mm
    return place


def _turn(axis: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Return the rotation about a unit axis (Rodrigues)."""
    x, y, z = axis.tolist()
    cross: NDArray[np.float64] = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    squared: NDArray[np.float64] = cross @ cross
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * squared


def _reaches(
    profile: ArmProfile,
    place: NDArray[np.float64],
    targets: NDArray[np.float64],
    pointing: NDArray[np.float64],
    stops: int,
) -> bool:
    geometry = profile.geometry
    tips = targets @ place[:3, :3].T + place[:3, 3]
    axes = pointing @ place[:3, :3].T
    shoulder = np.array([0.0, 0.0, geometry.d_mm[0]])
    if np.linalg.norm(tips - shoulder, axis=1).max() > LARGEST_REACH_MM:
        return False
    inverse = InverseKinematics(geometry)
    turn = np.array(profile.encoders.turn)
    angles = np.array(profile.home_counts) * (2.0 * np.pi / turn)
    angles[5] = 0.0
    try:
        for i, (tip, axis) in enumerate(zip(tips, axes, strict=True)):
            # As the script does: anew for each stop, then along the path.
            solve = inverse.solve_afresh if i < stops else inverse.solve
            angles = solve(tip, axis, angles)
            if abs(math.sin(angles[4])) < SMALLEST_WRIST:
                return False
    except UnreachableError:
        return False
    return True
