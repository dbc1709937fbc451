"""Refusals of a registration, by name."""

from enum import Enum

from disk import UserError


class RegistrationReason(Enum):
    """Why a registration was refused."""

    TOO_FEW = "too few points"
    COINCIDENT = "coincident points"
    COLLINEAR = "collinear points"
    SWAPPED = "swapped points"
    REFLECTED = "mirrored points"
    RESIDUAL = "residual too large"
    TARGET = "error at a target too large"
    SURFACE = "surface does not fit"
    FILE = "file gives no registration"


class RegistrationError(UserError):
    """A set of measurements that gives no trustworthy registration."""

    def __init__(self, reason: RegistrationReason, message: str) -> None:
        super().__init__(message)
        self.reason = reason
