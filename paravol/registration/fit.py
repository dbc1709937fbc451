"""From what was touched to a registration and how far to trust it."""

import datetime
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices import Registration, register
from devices.microscribe.kinematics.arm_errors import ArmErrors
from devices.microscribe.kinematics.inverse import UnreachableError
from devices.microscribe.kinematics.swing_check import swing_consistency
from devices.microscribe.kinematics.uncertainty import ParameterSpread
from devices.microscribe.wire.link import ArmDescription
from devices.registration.consistency import (
    REFUSED_CHANCE,
    LandmarkConsistency,
    landmark_consistency,
)
from devices.registration.fiducial_fit import (
    RegistrationError,
    RegistrationReason,
)
from devices.registration.held_point import HeldPoint
from devices.registration.pivot import PivotCalibration
from devices.registration.registration_file import (
    Agreement,
    PivotRecord,
    RegistrationRecord,
    TouchedLandmark,
)
from devices.registration.surface_fit import (
    Landmarks,
    Refinement,
    TracedSurface,
    refine,
)
from devices.registration.target_error import (
    BUDGET_MM,
    FitUncertainty,
    PointErrors,
    refuse_weak_targets,
    rms_mm,
)

SEAT_MM = 0.15
"""Per axis: a stylus' tip does not sit exactly in the middle of a hole."""

DENT_MM = 0.15
"""Skin gives way under the tip, all along the trace alike."""

SURFACE_MM = 0.2
"""Across the skin: tremor, rounding of counts, steps of the distance field."""


@dataclass(frozen=True, slots=True, eq=False)
class Touched:
    """All that was measured on the way; device frame."""

    held: list[HeldPoint]
    traced_mm: NDArray[np.float64]
    pivot: PivotCalibration | None


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A fitted registration with its expected errors."""

    registration: Registration
    targets_mm: dict[str, float]
    """Expected error of the tool at each target, rms."""
    surface_rms_mm: float
    agreement: Agreement | None = None


def fit_registration(
    touched: Touched,
    landmarks: dict[str, NDArray[np.float64]],
    surface: TracedSurface | None,
    targets: dict[str, NDArray[np.float64]],
    arm: ArmDescription,
    spread: ParameterSpread,
) -> Fit:
    """Fit landmarks and traced skin; raise RegistrationError when it cannot be trusted.

    ``landmarks`` and ``targets`` are positions (3,) by name, in the patient.
    """
    frames = np.stack([held.device_from_tip for held in touched.held])
    tips, places = frames[:, :3, 3], np.stack(list(landmarks.values()))
    first = register(tips, places, list(landmarks))
    constants = swing_ratio(arm, spread, touched.pivot)
    errors = arm_errors(arm, spread, touched.pivot).held_as(frames[0])
    seat = np.eye(3) * SEAT_MM**2
    own = np.stack([held.noise + seat for held in touched.held])
    at_touch = errors.at(frames, first.world_from_device, own)
    # What the swing told of the constants is no fault of the touches.
    doubted = replace(errors, spread=spread.scaled(constants))
    judged = landmark_consistency(
        *_fitted(first.world_from_device, tips, places),
        doubted.at(frames, first.world_from_device, own),
    )
    _refuse_landmarks(judged, list(landmarks), first.residual_rms_mm)
    whole = at_touch.noise + at_touch.common @ np.swapaxes(at_touch.common, 1, 2)
    weights = np.asarray(np.linalg.inv(whole), dtype=np.float64)
    pairs = Landmarks(tips, places, weights)
    # The shares of the points are known now; the axes of the covariances hold to first
    # order in the small turn that is left.
    refined = refine(
        first.world_from_device, pairs, touched.traced_mm, surface, SURFACE_MM
    )
    world_from_device = refined.world_from_device
    axis = frames[:, :3, 2].mean(axis=0)
    at_trace = _at_trace(errors, touched, refined, axis)
    dent = np.zeros((0, 3))
    if surface is not None:
        dent = DENT_MM * surface.normal(refined.points[len(tips) :])
    uncertainty = FitUncertainty.of(
        refined.points,
        refined.weights,
        _joined(
            _with_cause(at_touch, np.zeros_like(tips)), _with_cause(at_trace, dent)
        ),
    )
    places_of_targets = np.stack(list(targets.values()))
    tool = errors.at(
        _reaching(errors, world_from_device, places_of_targets, axis, list(targets)),
        world_from_device,
        np.zeros((len(targets), 3, 3)),
    )
    tool = _with_cause(tool, np.zeros_like(places_of_targets))
    expected = rms_mm(uncertainty.covariance(places_of_targets, tool))
    expected *= constants * judged.whole.ratio
    by_name = dict(zip(targets, expected.tolist(), strict=True))
    refuse_weak_targets(by_name)
    residuals = np.linalg.norm(_fitted(world_from_device, tips, places)[1], axis=1)
    rms = float(np.sqrt(np.mean(residuals**2)))
    registration = Registration(world_from_device, rms, residuals)
    agreement = Agreement(
        chance=judged.whole.chance,
        landmarks_ratio=judged.whole.ratio,
        constants_ratio=constants,
    )
    return Fit(registration, by_name, refined.surface_rms_mm, agreement)


def swing_ratio(
    arm: ArmDescription, spread: ParameterSpread, pivot: PivotCalibration | None
) -> float:
    """Return by how much the swing shows the constants to be worse than stated."""
    if pivot is None:
        return 1.0
    try:
        return swing_consistency(arm_errors(arm, spread, pivot), pivot).ratio
    except UnreachableError as error:
        raise RegistrationError(
            RegistrationReason.RESIDUAL,
            "The arm's constants cannot have made the poses of the swing; look at the "
            "arm by `paravol doctor --device`.",
        ) from error


def arm_errors(
    arm: ArmDescription, spread: ParameterSpread, pivot: PivotCalibration | None
) -> ArmErrors:
    """Gather what makes the poses of this arm with this tip wrong."""
    tip = np.zeros(3) if pivot is None else pivot.tip_mm
    covariance = np.zeros((3, 3)) if pivot is None else pivot.covariance
    return ArmErrors(arm.geometry, arm.encoders, spread, tip, covariance)


def describe_registration(
    fit: Fit,
    touched: Touched,
    landmarks: dict[str, NDArray[np.float64]],
    *,
    serial: str,
    model: str,
    head: str,
) -> RegistrationRecord:
    """Return what is written to the file; the device is told by serial and model."""
    pivot = touched.pivot
    names = list(landmarks)
    return RegistrationRecord(
        world_from_device=tuple(fit.registration.world_from_device.ravel().tolist()),
        tip_mm=_triple(np.zeros(3) if pivot is None else pivot.tip_mm),
        arm_serial=serial,
        arm_model=model,
        head=head,
        created=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        landmarks=tuple(
            TouchedLandmark(
                name=names[i],
                patient_mm=_triple(landmarks[names[i]]),
                device_mm=_triple(held.tip_mm),
                residual_mm=float(fit.registration.residuals_mm[i]),
                shake_mm=held.shake_mm,
            )
            for i, held in enumerate(touched.held)
        ),
        residual_rms_mm=fit.registration.residual_rms_mm,
        traced_points=len(touched.traced_mm),
        surface_rms_mm=fit.surface_rms_mm,
        targets=fit.targets_mm,
        agreement=fit.agreement,
        budget_mm=BUDGET_MM,
        pivot=None
        if pivot is None
        else PivotRecord(
            residual_mm=pivot.residual_mm,
            condition=pivot.condition,
            error_mm=float(np.sqrt(np.trace(pivot.covariance))),
        ),
    )


def _fitted(
    world_from_device: NDArray[np.float64],
    tips: NDArray[np.float64],
    places: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the registered tips (n, 3) and how far they miss their places, (n, 3)."""
    fitted = tips @ world_from_device[:3, :3].T + world_from_device[:3, 3]
    return fitted, places - fitted


def _refuse_landmarks(
    judged: LandmarkConsistency, names: list[str], residual_mm: float
) -> None:
    """Raise RegistrationError for a residual that hand and arm hardly ever leave."""
    if judged.whole.chance >= REFUSED_CHANCE:
        return
    worse = float(np.sqrt(judged.whole.statistic / judged.whole.freedom))
    told = (
        f"The landmarks fit to {residual_mm:.2f} mm rms, {worse:.1f} times as badly as "
        "this arm and a careful hand leave"
    )
    advice = (
        ". Register again with care; where that does not help, look at the arm by "
        "`paravol doctor --device`: its constants or an encoder may be wrong."
    )
    if judged.culprit is not None:
        advice = (
            f"; without {names[judged.culprit]!r} the others agree. Register again and "
            "rest the tip in the middle of that one."
        )
    raise RegistrationError(RegistrationReason.RESIDUAL, told + advice)


def _triple(point: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z


def _with_cause(errors: PointErrors, shifts: NDArray[np.float64]) -> PointErrors:
    """Add a shared cause that shifts the points by (n, 3)."""
    return PointErrors(
        errors.noise, np.concatenate((errors.common, shifts[:, :, None]), axis=2)
    )


def _joined(first: PointErrors, second: PointErrors) -> PointErrors:
    return PointErrors(
        np.concatenate((first.noise, second.noise)),
        np.concatenate((first.common, second.common)),
    )


def _at_trace(
    errors: ArmErrors,
    touched: Touched,
    refined: Refinement,
    axis: NDArray[np.float64],
) -> PointErrors:
    """Return the errors of the traced points, all with the stylus as at the touches."""
    frames = _frames(touched.traced_mm.reshape(-1, 3), axis)
    own = np.broadcast_to(np.eye(3) * SURFACE_MM**2, (len(frames), 3, 3))
    return errors.at(frames, refined.world_from_device, own)


def _reaching(
    errors: ArmErrors,
    world_from_device: NDArray[np.float64],
    places: NDArray[np.float64],
    axis: NDArray[np.float64],
    names: list[str],
) -> NDArray[np.float64]:
    """Return frames (m, 4, 4) with the tip at places (m, 3) of the patient."""
    device_from_world = np.linalg.inv(world_from_device)
    tips = places @ device_from_world[:3, :3].T + device_from_world[:3, 3]
    frames = _frames(tips, axis)
    for name, frame in zip(names, frames, strict=True):
        try:
            errors.angles(frame[None])
        except UnreachableError as error:
            raise RegistrationError(
                RegistrationReason.TARGET,
                f"The arm cannot reach {name!r} from where it stands; move its base "
                "nearer to the head and register again.",
            ) from error
    return frames


def _frames(
    tips: NDArray[np.float64], axis: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return frames at tips (n, 3) whose z axis is ``axis``, (3,)."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    frames = np.tile(np.eye(4), (len(tips), 1, 1))
    frames[:, :3, :3] = np.stack((x, np.cross(z, x), z), axis=1)
    frames[:, :3, 3] = tips
    return frames
