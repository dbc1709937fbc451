"""The deflectors: pulling, turning, swelling, cutting."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene.deflection.deflector import (
    LARGEST_SCALE,
    SAFETY,
    STEEPEST,
    Deflector,
    FoldError,
    Points,
    finite_vector,
    refuse_fold,
    weight,
)
from renderers.scene.deflection.inversion import pushed, rising_roots
from system import UserError


@dataclass(frozen=True, slots=True)
class Translation(Deflector):
    """Pull tissue along: what is seen at the centre comes from shift_mm away.

    Raises FoldError where |shift| reaches .617 of the radius.
    """

    shift_mm: NDArray[np.float64]

    def __post_init__(self) -> None:
        Deflector.__post_init__(self)
        shift = finite_vector("shift", self.shift_mm)
        object.__setattr__(self, "shift_mm", shift)
        refuse_fold("translation", float(np.linalg.norm(shift)), self.radius_mm)

    @property
    def stretch(self) -> float:
        """Return ``1 + |v| max |dw/dx|``."""
        return 1 + float(np.linalg.norm(self.shift_mm)) * STEEPEST / self.radius_mm

    def pull_back(self, points: Points) -> Points:
        """Return ``x - v w(x)``."""
        return points - self.shift_mm * self.share(points)[:, None]

    def push_forward(self, points: Points) -> Points:
        """Solve for x on the line through q along the shift."""
        shift = np.broadcast_to(self.shift_mm, points.shape)
        return pushed(self, points, shift)

    def jacobian(self, points: Points) -> NDArray[np.float64]:
        """Return ``I - v dw/dx``."""
        slope = self.slope(points)
        return np.eye(3) - self.shift_mm[:, None] * slope[:, None, :]


@dataclass(frozen=True, slots=True)
class Rotation(Deflector):
    """Turn tissue about an axis through the centre: by angle_rad there, right-handed.

    Never folds: distances from the centre are kept.
    """

    axis: NDArray[np.float64]
    angle_rad: float

    def __post_init__(self) -> None:
        Deflector.__post_init__(self)
        axis = finite_vector("axis", self.axis)
        length = float(np.linalg.norm(axis))
        if length == 0 or not math.isfinite(self.angle_rad):
            raise UserError(
                f"a rotation needs a direction and a finite angle, got {axis} and "
                f"{self.angle_rad}"
            )
        object.__setattr__(self, "axis", axis / length)

    @property
    def stretch(self) -> float:
        """Return ``1 + |angle| max 4 s^2 (1 - s^2)``: the shear of a turn."""
        return 1 + abs(self.angle_rad)

    def pull_back(self, points: Points) -> Points:
        """Turn back by the angle times w."""
        return self._turned(points, -self.angle_rad)

    def push_forward(self, points: Points) -> Points:
        """Turn by the angle times w, which the turn does not change."""
        return self._turned(points, self.angle_rad)

    def jacobian(self, points: Points) -> NDArray[np.float64]:
        """Return the turn, and its shear: ``R + (u x R (x - c)) d(angle)/dx``."""
        angle = -self.angle_rad * self.share(points)
        turn = _turns(self.axis, angle)
        arm = np.einsum("nij,nj->ni", turn, points - self.center_mm)
        shear = np.cross(self.axis, arm)
        slope = -self.angle_rad * self.slope(points)
        return turn + shear[:, :, None] * slope[:, None, :]

    def _turned(self, points: Points, angle_rad: float) -> Points:
        turn = _turns(self.axis, angle_rad * self.share(points))
        arm = np.einsum("nij,nj->ni", turn, points - self.center_mm)
        # exactly unmoved outside the ball
        return np.where(self.inside(points)[:, None], self.center_mm + arm, points)


@dataclass(frozen=True, slots=True)
class Scaling(Deflector):
    """Swell or shrink tissue about the centre: there by the factor.

    factor: above one swells. Raises FoldError outside of .457 to 20.
    """

    factor: float

    def __post_init__(self) -> None:
        Deflector.__post_init__(self)
        if not (math.isfinite(self.factor) and self.factor > 0):
            raise UserError(f"a scaling factor must be positive, got {self.factor}")
        if not -SAFETY <= self._k <= SAFETY * LARGEST_SCALE:
            raise FoldError(
                f"scaling by {self.factor:g} would fold the tissue; it may be "
                f"{1 / (1 + SAFETY * LARGEST_SCALE):.3f} to {1 / (1 - SAFETY):.0f}"
            )

    @property
    def stretch(self) -> float:
        """Return the slope at the centre, or where a swelling ends most abruptly."""
        return 1 + self._k if self._k > 0 else 1 + 0.8 * -self._k

    @property
    def _k(self) -> float:
        """Return k of ``q = c + (x - c)(1 + k w)``."""
        return 1 / self.factor - 1

    def pull_back(self, points: Points) -> Points:
        """Return ``c + (x - c)(1 + k w)``."""
        offset = points - self.center_mm
        return points + offset * (self._k * self.share(points))[:, None]

    def push_forward(self, points: Points) -> Points:
        """Solve for the distance from the centre."""
        offset = points - self.center_mm
        r = np.linalg.norm(offset, axis=-1) / self.radius_mm
        inside = r < 1

        def excess(x: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.asarray(x * (1 + self._k * weight(x**2)) - r[inside])

        stretch = np.ones(len(points))
        with np.errstate(divide="ignore", invalid="ignore"):
            found = rising_roots(excess, np.zeros(inside.sum()), np.ones(inside.sum()))
            ratio = np.where(r[inside] > 0, found / r[inside], 1.0)
        stretch[inside] = ratio
        return np.where(
            inside[:, None], self.center_mm + offset * stretch[:, None], points
        )

    def jacobian(self, points: Points) -> NDArray[np.float64]:
        """Return ``(1 + k w) I + k (x - c) dw/dx``."""
        offset = points - self.center_mm
        size = 1 + self._k * self.share(points)
        shear = self._k * offset[:, :, None] * self.slope(points)[:, None, :]
        return size[:, None, None] * np.eye(3) + shear


@dataclass(frozen=True, slots=True)
class Cut(Deflector):
    """Cut tissue along a plane through the centre and draw the sides apart.

    normal: of the plane. pull_mm: on each side. At the centre the gap reaches as far
    from the plane as ``h = pull w(h)``. In it is no tissue. Raises FoldError where the
    pull reaches .617 of the radius.
    """

    normal: NDArray[np.float64]
    pull_mm: float

    def __post_init__(self) -> None:
        Deflector.__post_init__(self)
        normal = finite_vector("normal", self.normal)
        length = float(np.linalg.norm(normal))
        if length == 0 or not (math.isfinite(self.pull_mm) and self.pull_mm > 0):
            raise UserError(
                f"a cut needs a normal and a positive pull, got {normal} and "
                f"{self.pull_mm} mm"
            )
        object.__setattr__(self, "normal", normal / length)
        refuse_fold("cut", self.pull_mm, self.radius_mm)

    @property
    def stretch(self) -> float:
        """Return that of a translation by the pull."""
        return 1 + self.pull_mm * STEEPEST / self.radius_mm

    def pull_back(self, points: Points) -> Points:
        """Move either side back; in the gap that is beyond the plane."""
        return points - self._shift(points) * self.share(points)[:, None]

    def push_forward(self, points: Points) -> Points:
        """Move either side out; the plane itself belongs to the side it points to."""
        return pushed(self, points, self._shift(points))

    def jacobian(self, points: Points) -> NDArray[np.float64]:
        """Return that of the side's translation."""
        shift, slope = self._shift(points), self.slope(points)
        return np.eye(3) - shift[:, :, None] * slope[:, None, :]

    def opening(self, points: Points) -> NDArray[np.float64]:
        """Return the distance beyond the face; infinite outside the ball."""
        height = np.abs((points - self.center_mm) @ self.normal)
        beyond = height - self.pull_mm * self.share(points)
        return np.where(self.inside(points), beyond, np.inf)

    def side(self, points: Points) -> NDArray[np.float64]:
        """Return 1 for places on the plane or where it points to, else -1."""
        return np.where((points - self.center_mm) @ self.normal >= 0, 1.0, -1.0)

    def _shift(self, points: Points) -> Points:
        return self.pull_mm * self.side(points)[:, None] * self.normal


def _turns(
    axis: NDArray[np.float64], angle: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return rotation matrices ``(n, 3, 3)`` about one unit axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + sine * cross + (1 - cosine) * (cross @ cross))
