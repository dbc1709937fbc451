"""Rims and faces of cuts in a splatted picture, as sharp as a ray sees them.

Discs stand out over the rims of a cut and blend its faces where they meet. So each
pixel that shows what is near a face asks the deformation itself: it keeps its depth
where that is on the surface, and looks along its ray where it is not.
"""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.deformation import SEAM_MM
from renderers.scene import Camera, GBuffer, Volume
from renderers.scene.deflection import Cut, Deflection

Points = NDArray[np.float64]

KEPT_MM = 0.02
"""A depth that is off by less is kept."""

BEFORE_MM = 1.0
"""A ray is followed from so far before what discs show."""

LEAST_STEP_MM, MOST_STEP_MM = 0.03, 0.5
MOST_STEPS = 160
HALVINGS = 9
TOLD_BY_MM = 1e-3
"""A face's normal is told by openings so far beside a place."""


class Seams:
    """Settle pixels beside the cuts of a deflection.

    distance: of the undeformed surface, mm, negative in air.
    """

    def __init__(self, distance: Volume, deflection: Deflection) -> None:
        self._distance = distance
        self._deflection = deflection
        self._slope_mm = 0.5 * float(distance.spacing_mm.min())
        self._has_cuts = any(isinstance(d, Cut) for d in deflection.deflectors)

    def beside(self, camera: Camera, result: GBuffer) -> NDArray[np.intp]:
        """Give the pixels that show what is near a face, counted row by row."""
        if not self._has_cuts:
            return np.empty(0, np.intp)
        shown = np.flatnonzero(result.coverage)
        depth = result.depth_mm.reshape(-1)[shown].astype(np.float64)
        eye, way = (part.reshape(-1, 3)[shown] for part in camera.rays())
        return shown[self._deflection.opening(eye + depth[:, None] * way) < SEAM_MM]

    def settle(self, camera: Camera, result: GBuffer) -> tuple[int, int]:
        """Change `result` in place; give the pixels asked and those that moved."""
        shown = self.beside(camera, result)
        if len(shown) == 0:
            return 0, 0
        depth = result.depth_mm.reshape(-1)[shown].astype(np.float64)
        eye, way = (part.reshape(-1, 3)[shown] for part in camera.rays())
        off = np.abs(self._inside(eye + depth[:, None] * way)) > KEPT_MM
        found = self._follow(eye[off], way[off], depth[off] - BEFORE_MM)
        depth[off] = np.where(np.isfinite(found), found, depth[off])
        normal = self._normals(eye + depth[:, None] * way)
        result.depth_mm.reshape(-1)[shown] = depth
        result.normal.reshape(-1, 3)[shown] = normal
        return len(shown), int(np.isfinite(found).sum())

    def _inside(self, x: Points) -> NDArray[np.float64]:
        """Give how deep in tissue places are, mm, never more than they are."""
        seen = self._distance.sample(self._deflection.pull_back(x))
        seen /= self._deflection.stretch
        return np.minimum(seen, self._deflection.opening(x))

    def _follow(self, eye: Points, way: Points, depth: Points) -> NDArray[np.float64]:
        """Give the depths at which rays come from air into tissue; infinite if none."""
        found = np.full(len(eye), np.inf)
        going = np.arange(len(eye))
        at = np.maximum(depth, 0.0)
        before = at.copy()
        was_air = np.zeros(len(eye), bool)
        for _ in range(MOST_STEPS):
            inside = self._inside(eye[going] + at[going, None] * way[going])
            met = (inside >= 0) & was_air[going]
            found[going[met]] = at[going[met]]
            was_air[going] = inside < 0
            going, inside = going[~met], inside[~met]
            if len(going) == 0:
                break
            before[going] = at[going]
            at[going] += np.clip(np.abs(inside), LEAST_STEP_MM, MOST_STEP_MM)
        met = np.isfinite(found)
        low, high, eye, way = before[met], found[met], eye[met], way[met]
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            in_air = self._inside(eye + middle[:, None] * way) < 0
            low, high = np.where(in_air, middle, low), np.where(in_air, high, middle)
        found[met] = high
        return found

    def _normals(self, x: Points) -> NDArray[np.float32]:
        """Give unit normals towards the air, as bent rays find them."""
        deflection = self._deflection
        q, field = deflection.pull_back(x), self._distance
        steps = self._slope_mm * np.eye(3)
        slope = [field.sample(q + step) - field.sample(q - step) for step in steps]
        slope_q = np.stack(slope, axis=1)
        rise = np.einsum("nji,nj->ni", deflection.jacobian(x), slope_q)
        face = deflection.opening(x) < field.sample(q)
        opened = [
            deflection.opening(x[face] + step) - deflection.opening(x[face] - step)
            for step in TOLD_BY_MM * np.eye(3)
        ]
        # beyond a ball's rim openings are infinite
        rise[face] = np.nan_to_num(np.stack(opened, axis=1), posinf=0.0, neginf=0.0)
        length = np.linalg.norm(rise, axis=1, keepdims=True)
        return np.asarray(-rise / np.maximum(length, 1e-12), np.float32)
