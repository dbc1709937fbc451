"""Hairs drawn over a shaded picture: lit by the scope, hidden by what is nearer."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from renderers.scene import (
    AirSurface,
    Camera,
    Change,
    GBuffer,
    Projection,
    RestOffsets,
)
from renderers.shading.bands import RowBands
from renderers.shading.illumination import ScopeLight
from renderers.shading.kernels.draw_hairs import (
    draw_strands,
    light_strands,
    project_strands,
)
from renderers.shading.strands import Strands

ALBEDO = (0.032, 0.020, 0.014)
"""Dark brown."""
GLOSS = 0.006
ROOT_MM = 0.2
"""A hair falls out where so much of the skin that it stands in is taken."""
MOVES_MM = 12.0
"""No tissue is shown so far from where it lies: dents and shifts add up to less."""
FIXED_POINT_STEPS = 24
"""Half steps, since tissue before a tool is both carried and pressed together."""


@dataclass(frozen=True, slots=True)
class PlacedStrands:
    """The strands of a view, lit.

    placed: ``(n, p, 4)``, see `project_strands`. colour: ``(n, p, 3)`` radiance. order:
    ``(n,)``, the farthest first.
    """

    placed: NDArray[np.float32]
    colour: NDArray[np.float32]
    order: NDArray[np.int64]


def shown_at(rest: RestOffsets, places_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where tissue ``(n, 3)`` that lies at places at rest is shown, mm.

    Solves ``p + offset(p) = place`` by fixed-point iteration, which converges since no
    offset changes by as much as the way over which it does.
    """
    voxel = rest.x.voxel_from_world
    at = places_mm @ voxel[:3, :3].T + voxel[:3, 3]
    # what is shown in the box lies in it: beyond it nothing moves
    near = np.all((at > rest.box[:3]) & (at < rest.box[3:]), axis=1)
    shown = np.array(places_mm, np.float64)
    places = shown[near]
    found = places.copy()
    for _ in range(FIXED_POINT_STEPS):
        found = 0.5 * (found + places - rest.sample(found))
    shown[near] = found
    return shown


class HairLayer:
    """Draw the hairs of one head.

    They are a layer of the picture and no part of the G-buffer: like all detail they
    move no depth, and they may be thinner than a pixel.
    """

    def __init__(self, surface: AirSurface, seed: int) -> None:
        wounds = surface.wounds
        self._distance, self._rest = surface.distance, surface.rest
        self._pristine = surface.distance if wounds is None else wounds.pristine
        # where they grew before anything was cut
        before = self._pristine if self._rest is None else self._rest.pristine
        grown = surface if wounds is None else replace(surface, distance=before)
        self._grown = self.strands = Strands.grow(grown, seed)
        self._albedo = np.array(ALBEDO, np.float32)
        voxel = surface.distance.voxel_from_world
        self._roots = self._grown.points_mm[:, 0] @ voxel[:3, :3].T + voxel[:3, 3]
        points = self._grown.points_mm.reshape(-1, 3)
        # a ball around them all
        self._middle = points.mean(axis=0) if len(points) else np.zeros(3)
        reach = np.linalg.norm(points - self._middle, axis=1)
        self._radius = self._reach = float(reach.max(initial=0.0))
        if wounds is not None:
            self.update()

    def update(self, change: Change | None = None) -> None:
        """Drop the hairs whose roots were cut away; what was undone has them again.

        Those that stand in tissue that is pushed go along with their roots. change:
        where; None for anywhere.
        """
        if change is not None and not self._is_near(change):
            return
        grown = self._grown
        roots = grown.points_mm[:, 0]
        self._reach = self._radius
        if self._rest is not None and self._rest.is_any and len(roots):
            moved = shown_at(self._rest, roots) - roots
            if moved.any():
                grown = replace(grown, points_mm=grown.points_mm + moved[:, None])
                roots = grown.points_mm[:, 0]
                self._reach += float(np.linalg.norm(moved, axis=1).max())
        taken = self._pristine.sample(roots) - self._distance.sample(roots)
        self.strands = grown.only(taken < ROOT_MM)

    def _is_near(self, change: Change) -> bool:
        """Return whether a change may move a hair, or take it away."""
        reach, roots = MOVES_MM / self._distance.spacing_mm, self._roots
        near = (roots >= change.low - reach) & (roots <= change.high + reach)
        return bool(near.all(axis=1).any())

    def place(
        self, camera: Camera, light: ScopeLight, sources: NDArray[np.float32]
    ) -> PlacedStrands | None:
        """Find where a view shows strands, and light them; None with none in view."""
        strands = self.strands
        if not len(strands.points_mm):
            return None
        pinhole = camera.projection is Projection.PERSPECTIVE
        # a hair's ends may be outside while it crosses the rim
        widest = 1.5 if pinhole else min(camera.extent + 0.3, 3.0)
        fold = camera.distortion.fold
        widest = min(widest, math.atan(fold) if pinhole else fold)
        if self._is_beyond(camera, widest):
            return None
        points = strands.points_mm - camera.eye_mm
        placed = np.zeros((*points.shape[:2], 4), np.float32)
        seen = project_strands(
            points,
            strands.radius_mm,
            np.ascontiguousarray(camera.frame[1:]),
            int(camera.projection),
            widest,
            camera.pixels_per_unit,
            (camera.distortion.k1, camera.distortion.k2),
            camera.width,
            camera.height,
            placed,
        )
        if not seen:
            return None
        colour = np.zeros(points.shape, np.float32)
        light_strands(
            points,
            sources,
            camera.frame[3],
            light.spread,
            light.power / len(sources),
            self._albedo,
            GLOSS,
            placed,
            colour,
        )
        # the farthest first
        order = np.argsort(-np.linalg.norm(points.mean(axis=1), axis=1), kind="stable")
        return PlacedStrands(placed, colour, order)

    def _is_beyond(self, camera: Camera, widest: float) -> bool:
        """Return whether all hairs are more than `widest` radians off the view axis."""
        # in plain numbers: this is all that most frames ask of hairs
        toward = (self._middle - camera.eye_mm).tolist()
        distance = math.hypot(*toward)
        if distance <= self._reach:
            return False
        along = camera.frame[3].tolist()
        cosine = sum(a * b for a, b in zip(toward, along, strict=True)) / distance
        off = math.acos(min(max(cosine, -1.0), 1.0))
        return off - math.asin(self._reach / distance) > widest


def draw_hairs(
    strands: PlacedStrands,
    radiance: NDArray[np.float32],
    gbuffer: GBuffer,
    camera: Camera,
    bands: RowBands,
) -> None:
    """Change `radiance` ``(h, w, 3)`` in place where hairs are nearest."""
    lens = camera.lens_table()

    def rows(first: int, last: int) -> None:
        draw_strands(
            strands.placed,
            strands.colour,
            strands.order,
            gbuffer.depth_mm,
            lens,
            camera.pixels_per_unit,
            radiance,
            first,
            last,
        )

    bands.run(gbuffer.size[0], rows)
