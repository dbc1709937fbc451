"""How far a registered tool may be from where it is shown, at a named place.

For equal, independent errors of the touched points the answer has a closed form, the
target registration error of Fitzpatrick, West and Maurer (IEEE Trans. Med. Imaging 17,
1998). Here the errors are whatever they are: a covariance for each point, and causes
that all points share (a wrong link length shifts every touch at once). The weighted fit
is linear in small errors, so that both go through it exactly to first order:

    xi = -sum_i K_i e_i,   K_i = H^-1 J_i^T W_i,   H = sum_i J_i^T W_i J_i

with e_i the error of point i and xi the shift and the rotation vector of the fit. The
residual of the fit (fiducial registration error) tells nothing about it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.registration.fiducial_fit import RegistrationError, RegistrationReason
from system import UserError

# Root sum of 0.1 mm rounding, 0.3 mm constants of the arm, 0.5 mm registration and
# 0.1 mm tip: what a good arm and a careful hand reach.
BUDGET_MM = 0.75

# Navigation in theatre is called accurate up to 2 mm (Labadie et al., 2005).
LARGEST_TARGET_MM = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class PointErrors:
    """Errors of n measured points in the patient's frame, mm."""

    noise: NDArray[np.float64]
    """(n, 3, 3) covariance of what is each point's own."""
    common: NDArray[np.float64]
    """(n, 3, k) shift of each point by one standard deviation of k shared causes."""

    def __post_init__(self) -> None:
        count, width = len(self.noise), self.common.shape[-1]
        if self.noise.shape != (count, 3, 3):
            raise UserError(f"noise must be (n, 3, 3), got {self.noise.shape}")
        if self.common.shape != (count, 3, width):
            raise UserError(
                f"common must be ({count}, 3, k) as noise, got {self.common.shape}"
            )

    @classmethod
    def isotropic(cls, count: int, rms_mm: float, causes: int = 0) -> "PointErrors":
        """Give n points the same independent error of this rms length."""
        noise = np.broadcast_to(np.eye(3) * rms_mm**2 / 3.0, (count, 3, 3))
        return cls(noise, np.zeros((count, 3, causes)))


def moves(
    points: NDArray[np.float64], centre: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how a shift and a turn about ``centre`` move points, (n, 3, 6)."""
    arm = points - centre
    rows = np.zeros((len(points), 3, 6))
    rows[:, [0, 1, 2], [0, 1, 2]] = 1.0
    rows[:, 0, 4], rows[:, 0, 5] = arm[:, 2], -arm[:, 1]
    rows[:, 1, 3], rows[:, 1, 5] = -arm[:, 2], arm[:, 0]
    rows[:, 2, 3], rows[:, 2, 4] = arm[:, 1], -arm[:, 0]
    return rows


@dataclass(frozen=True, slots=True, eq=False)
class FitUncertainty:
    """Uncertainty of a fitted motion: a shift and a turn about ``centre``."""

    centre: NDArray[np.float64]
    noise: NDArray[np.float64]
    """(6, 6) covariance of the shift (mm) and the rotation vector (rad)."""
    common: NDArray[np.float64]
    """(6, k) shift and turn by one standard deviation of each shared cause."""

    @classmethod
    def of(
        cls,
        points: NDArray[np.float64],
        weights: NDArray[np.float64],
        errors: PointErrors,
    ) -> "FitUncertainty":
        """Propagate the errors of points (n, 3) through their weighted fit.

        ``weights`` is (n, 3, 3): inverse covariances that the fit used, or n n^T /
        sigma^2 for a point of which only the distance to a surface was used. Raise
        RegistrationError(COLLINEAR) when the points leave a motion free.
        """
        centre = points.mean(axis=0)
        rows = moves(points, centre)
        pulled = np.swapaxes(rows, -1, -2) @ weights
        information = (pulled @ rows).sum(axis=0)
        # In units in which a turn moves a typical point as far as a shift.
        size = np.sqrt(np.mean(np.sum((points - centre) ** 2, axis=1))) or 1.0
        scale = np.array([1.0, 1.0, 1.0, *(1.0 / size,) * 3])
        spectrum = np.linalg.eigvalsh(scale[:, None] * information * scale)
        if not spectrum[0] > 1e-9 * spectrum[-1]:
            raise RegistrationError(
                RegistrationReason.COLLINEAR,
                "The touched points leave the patient free to turn; take one that is "
                "well off the line of the others.",
            )
        gain = -np.linalg.solve(information, pulled)
        noise = (gain @ errors.noise @ np.swapaxes(gain, -1, -2)).sum(axis=0)
        return cls(centre, noise, (gain @ errors.common).sum(axis=0))

    def covariance(
        self, targets: NDArray[np.float64], errors: PointErrors | None = None
    ) -> NDArray[np.float64]:
        """Return the covariance (m, 3, 3) of the registered tool at targets (m, 3).

        ``errors`` are those of the pose that brings the tool there, with the same
        shared causes; without them only the fit's own error is told.
        """
        causes = self.common.shape[-1]
        at = errors or PointErrors.isotropic(len(targets), 0.0, causes)
        if at.common.shape != (len(targets), 3, causes):
            raise UserError(
                f"targets need errors of {causes} shared causes for each of "
                f"{len(targets)} targets, got {at.common.shape}"
            )
        rows = moves(targets, self.centre)
        shared = rows @ self.common + at.common
        own = rows @ self.noise @ np.swapaxes(rows, -1, -2) + at.noise
        total: NDArray[np.float64] = own + shared @ np.swapaxes(shared, -1, -2)
        return total


def rms_mm(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rms length (m) of errors with covariances (m, 3, 3)."""
    return np.asarray(np.sqrt(np.trace(covariance, axis1=-2, axis2=-1)))


def fitzpatrick_rms_mm(
    points: NDArray[np.float64], targets: NDArray[np.float64], localisation_mm: float
) -> NDArray[np.float64]:
    """Return the target registration error (m) of points with equal errors.

    ``localisation_mm`` is the rms length of each point's error: TRE^2 = FLE^2 / n
    (1 + (1/3) sum_k d_k^2 / f_k^2), d_k the target's distance from principal axis k
    of the points, f_k theirs.
    """
    centre = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - centre, full_matrices=False)
    about = np.sum(spread**2) - spread**2
    along = (targets - centre) @ axes.T
    off = np.sum(along**2, axis=1, keepdims=True) - along**2
    share = (off / (about / len(points))).sum(axis=1) / 3.0
    return np.asarray(localisation_mm * np.sqrt((1.0 + share) / len(points)))


def refuse_weak_targets(
    rms_by_target: Mapping[str, float], largest_mm: float = LARGEST_TARGET_MM
) -> None:
    """Raise RegistrationError(TARGET) when a target may be off by more than allowed."""
    # A figure that is no number comes first.
    worst = max(
        rms_by_target, key=lambda name: np.nan_to_num(rms_by_target[name], nan=np.inf)
    )
    if not rms_by_target[worst] <= largest_mm:
        raise RegistrationError(
            RegistrationReason.TARGET,
            f"At {worst!r} the tool would be off by {rms_by_target[worst]:.1f} mm rms, "
            f"{largest_mm:g} mm is allowed; add a point that lies off the line of the "
            "others, or nearer to it.",
        )


def over_budget(
    rms_by_target: Mapping[str, float], budget_mm: float = BUDGET_MM
) -> Sequence[str]:
    """Return the targets whose error exceeds the budget, worst first."""
    beyond = [name for name, value in rms_by_target.items() if value > budget_mm]
    return sorted(beyond, key=lambda name: -rms_by_target[name])
