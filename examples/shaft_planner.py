"""Smooth motions of straight shafts through narrow air: how example paths are made.

A shaft is two points, its tip and a point on its axis well outside the nostril. Both
follow uniform cubic B-splines in time; their control points minimize

* the squared distances to the waypoints,
* the squared third differences (jerk: hands move smoothly), and
* the squared lack of clearance along the shaft, at many moments,

by a quasi-Newton method with exact gradients of the trilinear distance field.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.ndimage import map_coordinates
from scipy.optimize import minimize

from renderers.scene import Volume

Floats = NDArray[np.float64]

_DEGREE = 3
_SHAFT_STEP_MM = 1.5
"""Spacing of clearance samples along the shaft; the gap between spheres of 1.35 mm
radius placed this densely is below 0.3 mm."""
_MOMENTS_PER_S, _CONTROLS_PER_S = 8.0, 2.5
_JERK_WEIGHT, _CLEARANCE_WEIGHT = 0.02, 40.0
_ITERATIONS = 400


@dataclass(frozen=True, slots=True)
class Waypoint:
    """Ask for the shaft to be somewhere at a moment.

    tip_mm: ``(3,)`` world.
    handle_mm: ``(3,)`` world point the axis passes through outside the nose.
    """

    time_s: float
    tip_mm: Floats
    handle_mm: Floats


@dataclass(frozen=True, slots=True)
class Keepout:
    """Keep a shaft away from another moving straight shaft.

    tip_mm, handle_mm: ``(n, 3)`` of the other shaft at the planner's moments.
    distance_mm: least distance between the axes.
    """

    tip_mm: Floats
    handle_mm: Floats
    distance_mm: float


class ShaftPlanner:
    """Plan the motion of one straight shaft in a distance field."""

    def __init__(
        self,
        distance: Volume,
        *,
        duration_s: float,
        radius_mm: float,
        margin_mm: float,
        reach_mm: float,
    ) -> None:
        """Prepare splines and samples.

        distance: signed, mm, negative in air; outside the field is air.
        reach_mm: length of shaft that is kept clear.
        """
        self._matrix = distance.voxel_from_world
        self._field = np.ascontiguousarray(distance.values, dtype=np.float32)
        self._need = radius_mm + margin_mm
        self.moments = np.linspace(
            0.0, duration_s, int(duration_s * _MOMENTS_PER_S) + 1
        )
        count = int(duration_s * _CONTROLS_PER_S) + _DEGREE
        inner = np.linspace(0.0, duration_s, count - _DEGREE + 1)
        self._knots = np.concatenate(
            [np.zeros(_DEGREE), inner, np.full(_DEGREE, duration_s)]
        )
        self._count = count
        self._basis = self.basis(self.moments)
        self._along = np.arange(radius_mm, reach_mm, _SHAFT_STEP_MM)

    def basis(self, times_s: Floats) -> Floats:
        """Give the ``(n, controls)`` matrix from control points to positions."""
        matrix: Floats = BSpline.design_matrix(times_s, self._knots, _DEGREE).toarray()
        return matrix

    def plan(
        self, waypoints: list[Waypoint], keepout: Keepout | None = None
    ) -> tuple[Floats, Floats]:
        """Find control points ``(controls, 3)`` of tip and handle."""
        times = np.array([w.time_s for w in waypoints])
        rows = self.basis(times)
        wanted = [
            np.stack([w.tip_mm for w in waypoints]),
            np.stack([w.handle_mm for w in waypoints]),
        ]
        # each control point begins where the waypoints are at its Greville time
        windows = np.lib.stride_tricks.sliding_window_view(self._knots[1:-1], _DEGREE)
        at = windows.mean(axis=1)
        start = np.stack(
            [
                np.stack([np.interp(at, times, column) for column in ends.T], axis=1)
                for ends in wanted
            ]
        )
        third = np.diff(np.eye(self._count), n=3, axis=0)

        def cost(x: Floats) -> tuple[float, Floats]:
            control = x.reshape(2, self._count, 3)
            gradient = np.zeros_like(control)
            total = 0.0
            for which, target in enumerate(wanted):
                off = rows @ control[which] - target
                total += float((off**2).sum())
                gradient[which] += rows.T @ (2 * off)
            jerk = third @ control
            total += _JERK_WEIGHT * float((jerk**2).sum())
            gradient += _JERK_WEIGHT * 2 * (third.T @ jerk)
            tip, handle = self._basis @ control[0], self._basis @ control[1]
            lacks = [self._lack(tip, handle)]
            if keepout is not None:
                lacks.append(_crowding(tip, handle, keepout))
            for lack, *pushes in lacks:
                total += _CLEARANCE_WEIGHT * lack
                for which, push in enumerate(pushes):
                    gradient[which] += _CLEARANCE_WEIGHT * (self._basis.T @ push)
            return total, gradient.ravel()

        limits = {"maxiter": _ITERATIONS, "maxfun": 2 * _ITERATIONS}
        found = minimize(
            cost, start.ravel(), jac=True, method="L-BFGS-B", options=limits
        )
        control = found.x.reshape(2, self._count, 3)
        return control[0], control[1]

    def _lack(self, tip: Floats, handle: Floats) -> tuple[float, Floats, Floats]:
        """Sum squared lack of clearance; gradients by tip and handle ``(n, 3)``."""
        back = handle - tip
        length = np.linalg.norm(back, axis=1, keepdims=True)
        share = self._along[None, :] / length  # (n, k) of the way to the handle
        points = tip[:, None] + share[..., None] * back[:, None]
        value, slope = self._sample(points)
        short = np.maximum(self._need + value, 0.0)
        push = 2 * short[..., None] * slope
        # The share depends on the length; its change moves points along the shaft,
        # which is second order here and left out.
        d_handle = (push * share[..., None]).sum(axis=1)
        d_tip = (push * (1 - share[..., None])).sum(axis=1)
        return float((short**2).sum()), d_tip, d_handle

    def _sample(self, points: Floats) -> tuple[Floats, Floats]:
        """Interpolate the field and its gradient (per mm, world) at points."""
        voxel = points @ self._matrix[:3, :3].T + self._matrix[:3, 3]
        sample = partial(
            map_coordinates,
            self._field,
            order=1,
            mode="constant",
            cval=-50.0,
            output=np.float64,
        )
        columns = np.moveaxis(voxel[..., ::-1], -1, 0)
        slope = np.empty_like(voxel)
        for axis in range(3):
            step = np.zeros((3, *[1] * (columns.ndim - 1)))
            step[2 - axis] = 0.5
            slope[..., axis] = sample(columns + step) - sample(columns - step)
        # The jump to "outside" is no slope.
        slope[np.abs(slope) > 4.0] = 0.0
        return sample(columns), slope @ self._matrix[:3, :3]


def _crowding(
    tip: Floats, handle: Floats, other: Keepout
) -> tuple[float, Floats, Floats]:
    """Sum squared lack of distance to the other axis, sampled along the shaft."""
    direction = other.tip_mm - other.handle_mm
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    share = np.linspace(0.0, 0.9, 24)
    points = tip[:, None] + share[None, :, None] * (handle - tip)[:, None]
    offset = points - other.tip_mm[:, None]
    along = (offset * direction[:, None]).sum(-1, keepdims=True)
    # beside the other shaft: distance to its axis; ahead of it: to its tip
    across = offset - np.minimum(along, 0.0) * direction[:, None]
    gap = np.linalg.norm(across, axis=-1)
    short = np.maximum(other.distance_mm - gap, 0.0)
    push = -2 * (short / np.maximum(gap, 1e-9))[..., None] * across
    weight = share[None, :, None]
    return (
        float((short**2).sum()),
        (push * (1 - weight)).sum(axis=1),
        (push * weight).sum(axis=1),
    )
