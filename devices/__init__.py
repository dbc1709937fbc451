"""Tracked tools: where they are, how they are recorded, how they are registered."""

from devices.port import BytePort, DeviceError, DeviceReason
from devices.pose import Pose, PoseFlag
from devices.recording.path_file import load_probe_path, save_probe_path
from devices.recording.probe_path import ProbePath, ProbeSample
from devices.registration.fiducial_fit import (
    Registration,
    RegistrationError,
    RegistrationReason,
    register,
)

__all__ = [
    "BytePort",
    "DeviceError",
    "DeviceReason",
    "Pose",
    "PoseFlag",
    "ProbePath",
    "ProbeSample",
    "Registration",
    "RegistrationError",
    "RegistrationReason",
    "load_probe_path",
    "register",
    "save_probe_path",
]
