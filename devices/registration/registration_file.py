"""A registration on disk: JSON for us, an ITK transform for other programs."""

import json
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from devices.registration.fiducial_fit import (
    Registration,
    RegistrationError,
    RegistrationReason,
)
from system import ForeignFileError, UserError, simple_itk, whole_file
from system.typed_record import decode_json

LARGEST_FILE_BYTES = 10_000_000

Triple = tuple[float, float, float]


class TouchedLandmark(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One landmark: where it is, where it was touched, how far apart the fit left it.

    shake_mm: rms of the tip about its mean while it was held.
    """

    name: str
    patient_mm: Triple
    device_mm: Triple
    residual_mm: float
    shake_mm: float


class PivotRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How the tip was calibrated; error_mm is the tip's own, rms."""

    residual_mm: float
    condition: float
    error_mm: float


class Agreement(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How well what was measured agrees with what the errors are taken to be.

    chance: of so large a residual at the landmarks when the error model holds.
    landmarks_ratio, constants_ratio: by how much the landmarks and the swing of the
        tip showed errors to be larger; the expected errors contain both.
    """

    chance: float
    landmarks_ratio: float
    constants_ratio: float


class RegistrationRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A registration with all that tells how far to trust it; patient LPS, mm.

    world_from_device: 4 x 4, row by row.
    tip_mm: the tip in use, in the frame of the tip that the arm states.
    targets: expected error of a tool at named places, rms. The residual says nothing
        about it.
    """

    world_from_device: tuple[float, ...]
    tip_mm: Triple
    arm_serial: str
    arm_model: str
    head: str
    created: str
    landmarks: tuple[TouchedLandmark, ...]
    residual_rms_mm: float
    traced_points: int
    surface_rms_mm: float
    targets: dict[str, float]
    budget_mm: float
    pivot: PivotRecord | None = None
    agreement: Agreement | None = None
    format: Literal["paravol registration"] = "paravol registration"
    version: Literal[1] = 1

    @property
    def within_budget(self) -> bool:
        """Return whether every target is expected to meet the budget."""
        return all(error <= self.budget_mm for error in self.targets.values())

    def registration(self) -> Registration:
        """Build the transform; raise ValueError unless it is rigid."""
        return Registration(
            np.array(self.world_from_device).reshape(4, 4),
            self.residual_rms_mm,
            np.array([landmark.residual_mm for landmark in self.landmarks]),
        )


def save_registration(path: Path, record: RegistrationRecord) -> None:
    """Write the record as JSON, whole or not at all."""
    values = msgspec.to_builtins(record)
    text = json.dumps(values, indent=2, allow_nan=False) + "\n"

    with whole_file(path, makes_folder=False) as beside:
        beside.write_text(text, encoding="utf-8")


def load_registration(path: Path) -> RegistrationRecord:
    """Read a record; raise RegistrationError(FILE) when the file holds none."""
    try:
        if path.stat().st_size > LARGEST_FILE_BYTES:
            raise _not_one(path, "it is too large")
        content = path.read_bytes()
        record = decode_json(content, RegistrationRecord, path, "a registration")
        if len(record.world_from_device) != 16:
            raise _not_one(path, "world_from_device needs 16 numbers")
        record.registration()
    except OSError as error:
        raise _not_one(path, str(error.strerror)) from error
    except RegistrationError:
        raise
    except ForeignFileError as error:
        said = str(error).rstrip(".")
        raise RegistrationError(
            RegistrationReason.FILE, f"{said}; make one with `paravol register`."
        ) from error
    except ValueError as error:
        raise _not_one(path, str(error)) from error
    return record


def save_itk_transform(path: Path, world_from_device: NDArray[np.float64]) -> None:
    """Write a plain-text ITK transform (.tfm) for 3D Slicer and ITK, LPS and mm.

    ITK transforms map what is wanted to where it is taken from, here the patient to
    the device; 3D Slicer inverts them when it loads them, so that a model in the
    device's frame under this transform appears in the patient.
    """
    sitk = simple_itk()
    if path.suffix != ".tfm":
        raise UserError(f"an ITK transform is a .tfm file, got {path}")
    device_from_world = np.linalg.inv(world_from_device)
    transform = sitk.AffineTransform(3)
    transform.SetMatrix(device_from_world[:3, :3].ravel().tolist())
    transform.SetTranslation(device_from_world[:3, 3].tolist())

    with whole_file(path, makes_folder=False) as beside:
        sitk.WriteTransform(transform, str(beside))


def _not_one(path: Path, why: str) -> RegistrationError:
    return RegistrationError(
        RegistrationReason.FILE,
        f"{path} gives no registration: {why}; make one with `paravol register`.",
    )
