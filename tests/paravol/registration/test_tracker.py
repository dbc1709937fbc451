"""A tracker that states nothing is registered by how well its landmarks fit."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from devices import Pose, RegistrationError
from devices.registration.registration_file import RegistrationRecord
from paravol.registration.at_start import TRACKER
from paravol.registration.tracker import (
    LEAST_TOUCH_MM,
    register_tracker,
    touch_error_mm,
)

LANDMARKS = {
    "nasion": np.array([0.0, -90.0, 20.0]),
    "right cheek": np.array([-45.0, -70.0, -20.0]),
    "left cheek": np.array([46.0, -68.0, -24.0]),
    "tip of the nose": np.array([1.0, -115.0, -15.0]),
}
TARGETS = {
    "sphenoid ostium": np.array([4.0, -30.0, 10.0]),
    "frontal ostium": np.array([6.0, -60.0, 30.0]),
}


def _tracker(seed: int) -> NDArray[np.float64]:
    """Where the tracker stands: device_from_world, anywhere and anyhow turned."""
    rng = np.random.default_rng(seed)
    frame = np.eye(4)
    frame[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    frame[:3, 3] = rng.normal(size=3) * 800.0
    return frame


@dataclass
class Hand:
    """A person with a tracked pointer; also the guide that tells them what to do."""

    poses: list[Pose] = field(default_factory=list)
    said: list[str] = field(default_factory=list)

    def touch(self, place: NDArray[np.float64]) -> None:
        for i in range(60):
            frame = np.eye(4)
            frame[:3, 3] = place
            time_s = len(self.poses) / 60.0
            self.poses.append(Pose(time_s, time_s, frame, 1 if i < 40 else 0))

    def read(self, timeout_s: float) -> Pose:
        return self.poses.pop(0)

    def __call__(self, stage: str, share: float) -> None:
        pass

    def say(self, text: str) -> None:
        self.said.append(text)


def _registered(seed: int, touch_mm: float) -> RegistrationRecord:
    """Touch with an error of that rms length."""
    rng, place = np.random.default_rng(seed), _tracker(seed)
    hand = Hand()
    for point in LANDMARKS.values():
        off = rng.normal(size=3) * touch_mm / np.sqrt(3.0)
        hand.touch(place[:3, :3] @ (point + off) + place[:3, 3])
    times = np.arange(len(hand.poses)) / 60.0
    hand.poses = [
        Pose(float(t), float(t), p.device_from_tip, p.buttons)
        for t, p in zip(times, hand.poses, strict=True)
    ]
    return register_tracker(
        hand, hand, LANDMARKS, TARGETS, pivot=False, head="h", tool=lambda: "Pointer"
    )


def test_a_clean_touch_finds_where_the_tracker_stands() -> None:
    record = _registered(3, 0.0)
    found = np.array(record.world_from_device).reshape(4, 4)
    assert np.abs(found @ _tracker(3) - np.eye(4)).max() < 1e-9
    assert (record.arm_model, record.arm_serial) == (TRACKER, "Pointer")
    assert record.head == "h"
    # A perfect fit of four landmarks is luck, and is not believed.
    assert min(record.targets.values()) > LEAST_TOUCH_MM


@pytest.mark.parametrize("touch_mm", [0.5, 1.0])
def test_the_told_error_is_what_it_truly_is_on_the_average(touch_mm: float) -> None:
    true, told = [], []
    for seed in range(40):
        try:
            record = _registered(seed, touch_mm)
        except RegistrationError:
            continue
        found = np.array(record.world_from_device).reshape(4, 4) @ _tracker(seed)
        rng = np.random.default_rng(1000 + seed)
        for name, target in TARGETS.items():
            # The tool at a target is measured as wrongly as it was at a landmark.
            off = rng.normal(size=3) * touch_mm / np.sqrt(3.0)
            true.append((found @ np.array([*(target + off), 1.0]))[:3] - target)
            told.append(record.targets[name])
    assert len(told) > 50
    ratio = np.sqrt(np.mean(np.square(told))) / np.sqrt(
        np.mean(np.sum(np.square(true), axis=1))
    )
    assert 0.85 < ratio < 1.6


def test_landmarks_that_do_not_fit_are_refused() -> None:
    with pytest.raises(RegistrationError):
        _registered(1, 15.0)


def test_a_bad_fit_speaks_for_a_bad_touch() -> None:
    assert touch_error_mm(1.0, 4) == pytest.approx(np.sqrt(2.0))
    assert touch_error_mm(1.0, 10) == pytest.approx(np.sqrt(1.25))
    assert touch_error_mm(0.1, 4) == LEAST_TOUCH_MM
