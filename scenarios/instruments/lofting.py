"""Surfaces of steel: cross-sections laid along a line that bends in one plane."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderers.scene import Material, Mesh

SIDES = 32
"""Facets round a tube. At 10 mm from the lens of a 512-pixel picture a 3 mm tube is
100 pixels wide and the chord error of 32 facets a quarter of a pixel."""

LEAST_ARC_MM = 1e-3
"""A shorter bend is none."""

_ARC_STEP_DEG = 5.0
"""Turn of a bent line between two of its stations."""

_DOME = np.radians([12.0, 30.0, 48.0, 68.0, 90.0])
"""Where a half-round end has its rings, from its pole."""

Doubles = NDArray[np.float64]


def eased(begin: ArrayLike, end: ArrayLike, share: ArrayLike) -> Doubles:
    """Return what goes over from one size to another, level at both ends.

    share: 0 for the begin to 1 for the end.
    """
    first, part = np.asarray(begin, np.float64), np.asarray(share, np.float64)
    way: Doubles = np.asarray(end, np.float64) - first
    return first + way * (part * part * (3 - 2 * part))


@dataclass(frozen=True, slots=True)
class BentLine:
    """Describe the middle of a tool: its end is straight, then comes an arc, a shaft.

    A place on it is told by its length from the tip, mm. The tip is the origin, the
    shaft runs along +z, and the end is bent by `turn_deg` towards +y.
    """

    straight_mm: float = 0.0
    radius_mm: float = 1.0
    turn_deg: float = 0.0

    def at(self, lengths_mm: ArrayLike) -> Doubles:
        """Return places ``(n, 3)``, mm; the ends go on straight."""
        s = np.atleast_1d(np.asarray(lengths_mm, np.float64))
        total = math.radians(self.turn_deg)
        along = np.minimum(s, self.straight_mm)
        turned = np.clip((s - self.straight_mm) / self.radius_mm, 0.0, total)
        left = total - turned
        arc = self.radius_mm * total
        beyond = np.maximum(s - self.straight_mm - arc, 0.0)
        y = -along * math.sin(total)
        y += self.radius_mm * (math.cos(total) - np.cos(left))
        z = along * math.cos(total)
        z += self.radius_mm * (math.sin(total) - np.sin(left)) + beyond
        return np.stack([np.zeros_like(s), y, z], axis=1)

    def across(self, lengths_mm: ArrayLike) -> Doubles:
        """Return unit vectors ``(n, 3)`` across the line in its plane; +y at the shaft.

        Together with +x and the line itself they are a frame.
        """
        s = np.atleast_1d(np.asarray(lengths_mm, np.float64))
        total = math.radians(self.turn_deg)
        left = total - np.clip((s - self.straight_mm) / self.radius_mm, 0.0, total)
        return np.stack([np.zeros_like(s), np.cos(left), np.sin(left)], axis=1)

    def place(self, x: ArrayLike, y: ArrayLike, lengths_mm: ArrayLike) -> Doubles:
        """Return places ``(n, 3)`` beside the line, mm."""
        across = self.across(lengths_mm)
        beside = np.zeros((len(across), 3))
        beside[:, 0] = x
        placed: Doubles = self.at(lengths_mm) + beside
        placed += np.asarray(y, np.float64).reshape(-1, 1) * across
        return placed

    def stations(self, begin_mm: float, end_mm: float) -> Doubles:
        """Return lengths between which the line is straight enough, ends included."""
        first = self.straight_mm
        arc = self.radius_mm * math.radians(self.turn_deg)
        count = max(2, math.ceil(self.turn_deg / _ARC_STEP_DEG) + 1)
        # of stations nearer to each other no body could be made
        inner = np.empty(0)
        if arc > LEAST_ARC_MM:
            inner = np.linspace(first, first + arc, count)
        inner = inner[(inner > begin_mm + 1e-6) & (inner < end_mm - 1e-6)]
        return np.concatenate([[begin_mm], inner, [end_mm]])

    def bend(self, begin_mm: float, end_mm: float) -> Doubles:
        """Return places ``(n, 3)`` of which four at most are enough for a shadow."""
        arc = self.radius_mm * math.radians(self.turn_deg)
        corners = self.straight_mm + arc * np.array([0.5, 1.0])
        inner = corners[(corners > begin_mm) & (corners < end_mm) & (arc > 0.0)]
        return self.at(np.concatenate([[begin_mm], inner, [end_mm]]))


def section(sides: int, power: float = 2.0) -> Doubles:
    """Return a superellipse ``(sides, 2)`` of half sizes 1; power 2 is round."""
    angles = np.arange(sides) * (2 * math.pi / sides)
    both = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    place: Doubles = np.sign(both) * np.abs(both) ** (2.0 / power)
    return place


def rings(
    line: BentLine,
    lengths_mm: Doubles,
    half_mm: Doubles,
    outline: Doubles,
    offset_mm: float | Doubles = 0.0,
) -> Doubles:
    """Lay an outline ``(n, 2)`` across a line, ``(m, n, 3)``.

    half_mm: ``(m, 2)`` half sizes along x and across. offset_mm: of the middle, across.
    """
    shape = len(lengths_mm), len(outline)
    x = half_mm[:, :1] * outline[:, 0]
    y = half_mm[:, 1:] * outline[:, 1] + np.reshape(offset_mm, (-1, 1))
    s = np.broadcast_to(lengths_mm[:, None], shape)
    return line.place(x.ravel(), y.ravel(), s.ravel()).reshape(*shape, 3)


def rod(
    line: BentLine,
    begin_mm: float,
    end_mm: float,
    half_mm: tuple[float, float],
    *,
    sides: int = SIDES,
    power: float = 2.0,
    offset_mm: float = 0.0,
) -> Mesh:
    """Return a rod with half-round ends between two lengths of a line."""
    shorter = min(half_mm)
    round_mm = shorter * (1.0 - np.cos(_DOME))
    scale = np.sin(_DOME)
    straight = line.stations(begin_mm + shorter, end_mm - shorter)
    lengths = np.concatenate(
        [begin_mm + round_mm[:-1], straight, end_mm - round_mm[-2::-1]]
    )
    inset = np.concatenate([scale[:-1], np.ones(len(straight)), scale[-2::-1]])
    # the longer side is rounded by as much as the shorter one
    half = np.maximum(np.array(half_mm) - shorter * (1.0 - inset[:, None]), 1e-3)
    return skin(rings(line, lengths, half, section(sides, power), offset_mm))


def skin(rows: Doubles, *, closed: bool = False) -> Mesh:
    """Join rings ``(m, n, 3)`` to a closed surface that faces outwards.

    closed: joins the last ring to the first; otherwise a fan closes either end.
    """
    count, sides = rows.shape[:2]
    i = np.arange(count if closed else count - 1)[:, None] * sides
    after = (i + sides) % (count * sides)
    j = np.arange(sides)
    k = (j + 1) % sides
    first = np.stack([i + j, after + j, i + k], axis=-1)
    second = np.stack([after + j, after + k, i + k], axis=-1)
    faces = np.stack([first, second], axis=2).reshape(-1, 3)
    vertices = rows.reshape(-1, 3)
    if not closed:
        front = np.full(sides, count * sides)
        back = (count - 1) * sides
        poles = np.stack([rows[0].mean(axis=0), rows[-1].mean(axis=0)])
        vertices = np.concatenate([vertices, poles])
        faces = np.concatenate(
            [
                faces,
                np.stack([front, j, k], axis=1),
                np.stack([front + 1, back + k, back + j], axis=1),
            ]
        )
    if np.linalg.det(vertices[faces]).sum() < 0:
        faces = faces[:, ::-1]
    return Mesh(vertices, faces.astype(np.int32), Material.METAL)


def joined(*meshes: Mesh) -> Mesh:
    """Return one mesh of several that may reach into each other."""
    ends = np.cumsum([len(mesh.vertices) for mesh in meshes])
    faces = [
        mesh.faces + int(end) - len(mesh.vertices)
        for mesh, end in zip(meshes, ends, strict=True)
    ]
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate(faces).astype(np.int32),
        Material.METAL,
    )


def mirrored(mesh: Mesh) -> Mesh:
    """Return a mesh on the other side of the plane y = 0."""
    return Mesh(
        mesh.vertices * np.array([1.0, -1.0, 1.0]), mesh.faces[:, ::-1], mesh.material
    )
