"""What a tool is made of: rigid parts, of which some turn about a hinge."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderers.scene import Mesh
from surgery import solids

Doubles = NDArray[np.float64]

MARGIN_MM = 0.25
"""No part of a tool lies farther outside its capsules."""


@dataclass(frozen=True, slots=True)
class Capsules:
    """Balls swept along segments: what a tool is to contact and clearance.

    start_mm, end_mm: ``(n, 3)``. radius_mm: ``(n,)``.
    """

    start_mm: Doubles
    end_mm: Doubles
    radius_mm: Doubles

    @classmethod
    def along(cls, points_mm: Doubles, radius_mm: ArrayLike) -> "Capsules":
        """Return one capsule between each point ``(n, 3)`` and the next.

        radius_mm: one for all, or ``(n - 1,)``.
        """
        radius = np.broadcast_to(radius_mm, (len(points_mm) - 1,)).astype(np.float64)
        return cls(points_mm[:-1], points_mm[1:], radius)

    @classmethod
    def joined(cls, several: Sequence["Capsules"]) -> "Capsules":
        """Return the capsules of all."""
        return cls(
            np.concatenate([each.start_mm for each in several]),
            np.concatenate([each.end_mm for each in several]),
            np.concatenate([each.radius_mm for each in several]),
        )

    def table(self) -> Doubles:
        """Return them as rows ``(n, 7)``: start, end, radius."""
        columns = self.start_mm, self.end_mm, self.radius_mm[:, None]
        return np.concatenate(columns, axis=1)

    def rows(self) -> solids.Rows:
        """Return them as rows of `surgery.solids`."""
        rows = np.zeros((len(self.radius_mm), solids.ROW))
        rows[:, 0], rows[:, 1:8] = solids.CAPSULE, self.table()
        return rows

    def placed(self, pose: Doubles) -> "Capsules":
        """Move them by a rigid 4x4 transform."""
        return Capsules(
            moved(self.start_mm, pose), moved(self.end_mm, pose), self.radius_mm
        )


def shaded(mesh: Mesh, capsules: Capsules) -> Mesh:
    """Return the mesh with the capsules that cast its shadow."""
    return Mesh(mesh.vertices, mesh.faces, mesh.material, capsules.table())


@dataclass(frozen=True, slots=True)
class InstrumentPart:
    """A rigid part in the tool's frame, as it lies when the jaws are closed.

    hinge_mm: ``(y, z)`` of the axis along x that it turns about. open_deg: its turn
    when the jaws are open, right-handed about +x; 0 for what does not move.
    """

    mesh: Mesh
    capsules: Capsules
    hinge_mm: tuple[float, float] = (0.0, 0.0)
    open_deg: float = 0.0

    def pose(self, jaw: float) -> Doubles:
        """Return the part's 4x4 pose in the tool; jaw: 0 open, 1 closed."""
        return turned_about(self.hinge_mm, self.open_deg * (1.0 - jaw))


NO_BITE = np.zeros((0, solids.ROW))
"""Of what has no jaws."""


class Shape(ABC):
    """Describe a tool's form by its sizes."""

    @abstractmethod
    def parts(self) -> tuple[InstrumentPart, ...]:
        """Return its rigid parts, the shaft first."""

    @abstractmethod
    def tip(self) -> tuple[Doubles, float]:
        """Return middle ``(3,)`` and radius of the ball at its end, mm."""

    def end(self, length_mm: float) -> Capsules:
        """Return one or two capsules of so much of its end, mm, the tip first.

        For what gives way to it. Straight along +z, where a tool is not bent there.
        """
        middle, radius = self.tip()
        behind = middle + np.array([0.0, 0.0, length_mm])
        return Capsules.along(np.stack([middle, behind]), radius)

    def edge(self) -> tuple[Doubles, float]:
        """Return corners ``(n, 3)`` of what takes tissue where it moves; its radius."""
        return np.zeros((0, 3)), 0.0

    def bite(self, jaw: float) -> solids.Rows:
        """Return what the jaws enclose when they close from `jaw`; tool's frame."""
        return NO_BITE


@lru_cache(maxsize=64)
def turned_about(hinge_mm: tuple[float, float], angle_deg: float) -> Doubles:
    """Return a turn about an axis along x through ``(y, z)``, 4x4, read only."""
    pose = np.eye(4)
    turn = np.radians(angle_deg)
    cosine, sine = np.cos(turn), np.sin(turn)
    pose[1:3, 1:3] = [[cosine, -sine], [sine, cosine]]
    hinge = np.array(hinge_mm)
    pose[1:3, 3] = hinge - pose[1:3, 1:3] @ hinge
    pose.flags.writeable = False
    return pose


def moved(points_mm: Doubles, pose: Doubles) -> Doubles:
    """Move points ``(n, 3)`` by a rigid 4x4 transform."""
    result: Doubles = points_mm @ pose[:3, :3].T + pose[:3, 3]
    return result
