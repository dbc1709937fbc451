"""Where vibrissae grow: on skin inside the nostril, for a seed always the same."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from renderers.scene import AirSurface, Volume

SPACING_MM = 2.0
"""Least distance of two roots: some fifty hairs in a nostril."""

LENGTH_MM = (2.0, 4.0)
RADIUS_MM = 0.045
TIP_SHARE = 0.35
"""A hair's radius at its tip, of that at its root."""

LEAN = (0.5, 1.2)
"""Radians between a hair and the skin's normal at the root."""
BEND = 0.9
"""Most radians by which its direction turns from root to tip."""

LEAST_SKIN = 0.6
"""Share of skin at a root: none grow where skin turns into mucosa."""

ACROSS_MM = 22.0
"""Over a root inside the nostril there is another wall within this."""

POINTS = 9
"""Of a strand's line, root and tip included."""

_ROOM_MM = 0.05
"""A hair ends where it would come so near to a wall again."""

Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Strands:
    """Hairs as lines.

    points_mm: ``(n, POINTS, 3)`` world, root first. radius_mm: ``(n, POINTS)``.
    """

    points_mm: Doubles
    radius_mm: Doubles

    @classmethod
    def grow(cls, surface: AirSurface, seed: int) -> "Strands":
        """Grow hairs on the skin that has another wall before it.

        The same surface and seed give the same hairs in every renderer and tier.
        """
        rng = np.random.default_rng((seed, 0x686169))
        roots, normals = _roots(surface, rng)
        count = len(roots)
        # one draw of everything for each, used or not: a hair does not depend on others
        length = rng.uniform(*LENGTH_MM, count)
        lean = rng.uniform(*LEAN, count)
        turn = rng.uniform(0, 2 * np.pi, count)
        bend = rng.uniform(-BEND, BEND, count)
        side = _across(normals)
        other = np.cross(normals, side)
        along = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other
        share = np.linspace(0, 1, POINTS)
        # a circular arc that leaves the skin at `lean` and bends in its own plane
        middle = (share[1:] + share[:-1]) / 2
        angle = lean[:, None] + bend[:, None] * middle
        steps = (
            np.cos(angle)[..., None] * normals[:, None]
            + np.sin(angle)[..., None] * along[:, None]
        )
        steps *= (length / (POINTS - 1))[:, None, None]
        points = np.concatenate([np.zeros((count, 1, 3)), np.cumsum(steps, axis=1)], 1)
        points += roots[:, None]
        points = _kept_in_air(points, surface.distance)
        radius = RADIUS_MM * (1 - (1 - TIP_SHARE) * share)
        return cls(points, np.broadcast_to(radius, points.shape[:2]).copy())

    def only(self, wanted: NDArray[np.bool_]) -> "Strands":
        """Return those of the hairs that are wanted, ``(n,)``."""
        return Strands(self.points_mm[wanted], self.radius_mm[wanted])


def _roots(surface: AirSurface, rng: np.random.Generator) -> tuple[Doubles, Doubles]:
    """Choose places on the skin and their normals towards air, both ``(n, 3)``."""
    distance, skin = surface.distance, surface.skin
    half = float(distance.spacing_mm.max()) / 2
    near = np.abs(distance.values) < half
    near &= skin.values > 255 * LEAST_SKIN
    # beside the grid's sides there is no slope
    near[[0, -1]] = near[:, [0, -1]] = near[:, :, [0, -1]] = False
    voxels = np.argwhere(near)[:, ::-1].astype(np.float64)
    nothing = np.zeros((0, 3))
    if not len(voxels):
        return nothing, nothing
    m = distance.world_from_voxel
    places = voxels @ m[:3, :3].T + m[:3, 3]
    places = places[rng.permutation(len(places))]
    tree = cKDTree(places)
    free = np.ones(len(places), np.bool_)
    chosen = []
    for n, place in enumerate(places):
        if free[n]:
            chosen.append(n)
            free[tree.query_ball_point(place, SPACING_MM)] = False
    places = places[chosen]
    normals = _normals(distance, places)
    # down to the surface itself
    places += distance.sample(places)[:, None] * normals
    inside = _is_faced(distance, places, normals)
    return places[inside], normals[inside]


def _normals(distance: Volume, places: Doubles) -> Doubles:
    step = float(distance.spacing_mm.max())
    slope = np.stack(
        [
            distance.sample(places + step * axis)
            - distance.sample(places - step * axis)
            for axis in np.eye(3)
        ],
        axis=1,
    )
    length = np.linalg.norm(slope, axis=1, keepdims=True)
    normals: Doubles = -slope / np.maximum(length, 1e-9)
    return normals


def _is_faced(distance: Volume, places: Doubles, normals: Doubles) -> NDArray[np.bool_]:
    """Return whether there is another wall over a place within `ACROSS_MM`."""
    t = np.full(len(places), 0.5)
    met = np.zeros(len(places), np.bool_)
    while np.any(going := ~met & (t < ACROSS_MM)):
        at = distance.sample(places[going] + t[going, None] * normals[going])
        # beyond the grid its background is no wall
        met[going] = (at > -_ROOM_MM) & (t[going] > 1)
        t[going] += np.maximum(-0.9 * at, 0.2)
    m = distance.voxel_from_world
    voxel = (places + t[:, None] * normals) @ m[:3, :3].T + m[:3, 3]
    within = np.all((voxel > 0) & (voxel < np.array(distance.shape[::-1]) - 1), axis=1)
    return np.asarray(met & within)


def _across(normals: Doubles) -> Doubles:
    """Return a direction across each."""
    axis = np.eye(3)[np.abs(normals).argmin(axis=1)]
    side = np.cross(normals, axis)
    result: Doubles = side / np.linalg.norm(side, axis=1, keepdims=True)
    return result


def _kept_in_air(points: Doubles, distance: Volume) -> Doubles:
    """Shorten strands ``(n, POINTS, 3)`` that would grow into a wall.

    The first piece leaves the wall that the hair stands on.
    """
    touches = distance.sample(points) > -_ROOM_MM
    touches[:, :2] = False
    first = np.where(touches.any(axis=1), touches.argmax(axis=1), POINTS) - 1
    share = np.linspace(0, 1, POINTS) * first[:, None]
    low = np.minimum(share.astype(int), POINTS - 2)
    rest = (share - low)[..., None]
    rows = np.arange(len(points))[:, None]
    shortened: Doubles = (1 - rest) * points[rows, low] + rest * points[rows, low + 1]
    return shortened
