"""Rigid registration of a second scan to the first by mutual information.

CT and MR share no values, but where one changes so does the other (Wells et al. 1996;
Mattes et al. 2003). From coarse to fine, and then once more from places that are off on
purpose: a registration that does not come back to the same place is refused.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from anatomy.files.volumes import as_image
from anatomy.scan.scan import isotropic, patient_box
from anatomy.tissue import SURFACE_HU
from renderers.scene.volume import Volume
from system import UserError, simple_itk

Image: TypeAlias = Any
Transform: TypeAlias = Any
"""Of SimpleITK, which carries no types."""

WORKING_MM = 2.0
"""Voxels on which the scans are compared; the optimum is found to a tenth of one."""

BINS = 40
SEED = 20

LEVELS = ((3, 3.0, 1.0), (2, 1.5, 0.6), (1, 0.0, 0.2))
"""Shrinking in voxels, smoothing in mm and the share of voxels compared, from coarse
to fine."""

STARTS_OFF = (
    ((6.0, -5.0, 4.0), (4.0, -3.0, 3.0)),
    ((-5.0, 6.0, -6.0), (-3.0, 4.0, 4.0)),
)
"""Shifts in mm and turns in degrees from which it must come back."""

LARGEST_RETURN_MM = 1.5
LEAST_OVERLAP = 0.3
LEAST_SHARED = 0.05
"""Of the smaller scan's entropy, known from the other scan. Noise shares none."""

REACH_MM = 60.0
"""From the middle, where differences between transforms are measured."""

Level = tuple[int, float, float]

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True)
class VolumeRegistration:
    """Where the second scan lies in the first one's world, and how sure that is.

    first_from_second: 4x4 LPS mm. return_mm: largest distance, 60 mm around the
    middle, between where it came to rest from different starts. shared: mutual
    information as a share of the smaller entropy, 0 to 1. overlap: share of the
    first scan's tissue that the second one covers.
    """

    first_from_second: NDArray[np.float64]
    return_mm: float
    shared: float
    overlap: float


def register_volumes(
    first: Volume, second: Volume, progress: Progress | None = None
) -> VolumeRegistration:
    """Find the rigid transform that lays the second scan onto the first.

    Both hold CT numbers or what was brought onto their scale. Raises UserError, with
    the figure that is bad, when the scans cannot be brought together.
    """
    sitk = simple_itk()
    fixed, moving = _image(first), _image(second)
    start = sitk.CenteredTransformInitializer(
        # the head, not the air around it, has its middle laid onto the other's
        sitk.Cast(fixed > SURFACE_HU, sitk.sitkFloat32),
        sitk.Cast(moving > SURFACE_HU, sitk.sitkFloat32),
        sitk.Euler3DTransform(),
        sitk.CenteredTransformInitializerFilter.MOMENTS,
    )
    rounds = 1 + len(STARTS_OFF)

    def report(done: int) -> None:
        if progress is not None:
            progress("Registering the second scan", done / rounds)

    report(0)
    best = _optimized(fixed, moving, sitk.Euler3DTransform(start), LEVELS)
    report(1)
    returns = []
    for number, (shift, turn) in enumerate(STARTS_OFF, start=2):
        off = sitk.Euler3DTransform(best)
        angles = np.add(best.GetParameters()[:3], np.radians(turn))
        off.SetParameters([*angles, *np.add(best.GetParameters()[3:], shift)])
        again = _optimized(fixed, moving, off, LEVELS[1:])
        returns.append(_apart_mm(best, again, first.center_mm))
        report(number)
    return_mm = max(returns)
    second_from_first = _matrix(best)
    shared, overlap = _agreement(fixed, moving, best)
    if overlap < LEAST_OVERLAP:
        raise UserError(
            f"the second scan covers only {overlap:.0%} of the first one's tissue; "
            f"{LEAST_OVERLAP:.0%} are needed to register them"
        )
    if return_mm > LARGEST_RETURN_MM or shared < LEAST_SHARED:
        raise UserError(
            f"the second scan cannot be registered: from other starts it comes to rest "
            f"{return_mm:.1f} mm away ({LARGEST_RETURN_MM:g} are allowed) and shares "
            f"{shared:.1%} of its information ({LEAST_SHARED:.0%} are needed); is it "
            "the same head?"
        )
    first_from_second = np.linalg.inv(second_from_first).astype(np.float64)
    return VolumeRegistration(first_from_second, return_mm, shared, overlap)


def resampled(second: Volume, registration: VolumeRegistration, grid: Volume) -> Volume:
    """Sample the second scan on a grid of the first one's world, trilinear, int16."""
    sitk = simple_itk()
    second_from_first = np.linalg.inv(registration.first_from_second)
    transform = sitk.AffineTransform(3)
    transform.SetMatrix(second_from_first[:3, :3].ravel().tolist())
    transform.SetTranslation(second_from_first[:3, 3].tolist())
    sampled = sitk.Resample(
        as_image(second),
        list(grid.shape[::-1]),
        transform,
        sitk.sitkLinear,
        grid.origin_mm.tolist(),
        grid.spacing_mm.tolist(),
        grid.direction.ravel().tolist(),
        second.background,
        sitk.sitkFloat32,
    )
    values = sitk.GetArrayFromImage(sampled)
    whole = np.clip(np.rint(values), -32768, 32767).astype(np.int16)
    return grid.with_values(whole, second.background)


def _image(volume: Volume) -> Image:
    """Bring a scan to the working size, limited to where tissues differ."""
    low, high = patient_box(volume)
    coarse = isotropic(volume, WORKING_MM, low, high)
    values = np.clip(coarse.values, -1000.0, 1000.0)
    return as_image(coarse.with_values(values, coarse.background))


def _optimized(
    fixed: Image, moving: Image, start: Transform, levels: tuple[Level, ...]
) -> Transform:
    sitk = simple_itk()
    method = sitk.ImageRegistrationMethod()
    # sums in one order, for the same result every time
    method.SetNumberOfThreads(1)
    method.SetMetricAsMattesMutualInformation(BINS)
    method.SetMetricSamplingStrategy(method.RANDOM)
    method.SetMetricSamplingPercentagePerLevel([share for *_, share in levels], SEED)
    method.SetInterpolator(sitk.sitkLinear)
    method.SetOptimizerAsRegularStepGradientDescent(
        learningRate=2.0,
        minStep=1e-3,
        numberOfIterations=120,
        relaxationFactor=0.6,
        gradientMagnitudeTolerance=1e-7,
    )
    method.SetOptimizerScalesFromPhysicalShift()
    method.SetShrinkFactorsPerLevel([shrink for shrink, _, _ in levels])
    method.SetSmoothingSigmasPerLevel([sigma for _, sigma, _ in levels])
    method.SmoothingSigmasAreSpecifiedInPhysicalUnitsOn()
    method.SetInitialTransform(start, inPlace=True)
    try:
        method.Execute(fixed, moving)
    except RuntimeError as error:
        raise UserError(
            "the second scan cannot be registered: the two do not overlap"
        ) from error
    return start


def _matrix(transform: Transform) -> NDArray[np.float64]:
    """Return a centred rotation as 4x4: second's world from the first's."""
    turn = np.array(transform.GetMatrix()).reshape(3, 3)
    center, shift = np.array(transform.GetCenter()), transform.GetTranslation()
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    matrix[:3, 3] = center + shift - turn @ center
    return matrix


def _apart_mm(one: Transform, other: Transform, middle: NDArray[np.float64]) -> float:
    corners = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, 8) / np.sqrt(3)
    points = middle[:, None] + REACH_MM * corners
    ends = [m[:3, :3] @ points + m[:3, 3:] for m in (_matrix(one), _matrix(other))]
    return float(np.linalg.norm(ends[0] - ends[1], axis=0).max())


def _agreement(
    fixed: Image, moving: Image, transform: Transform
) -> tuple[float, float]:
    """Measure shared information and overlap on the working grid."""
    sitk = simple_itk()
    outside = -2000.0
    moved = sitk.GetArrayFromImage(
        sitk.Resample(moving, fixed, transform, sitk.sitkLinear, outside)
    )
    first = sitk.GetArrayFromImage(fixed)
    covered = moved > outside
    tissue = first > SURFACE_HU
    overlap = float((covered & tissue).sum() / max(tissue.sum(), 1))
    if not covered.any():
        return 0.0, 0.0
    counts, _, _ = np.histogram2d(first[covered], moved[covered], bins=BINS)
    joint = counts / counts.sum()
    entropies = [_entropy(joint.sum(axis=axis)) for axis in (0, 1)]
    information = sum(entropies) - _entropy(joint.ravel())
    return float(information / max(min(entropies), 1e-9)), overlap


def _entropy(share: NDArray[np.float64]) -> float:
    some = share[share > 0]
    return float(-(some * np.log(some)).sum())
