"""What the walls of the nose send one another, by Monte Carlo.

Every wall is diffuse with the albedo of its blood and skin (without the fine mottle,
which averages out over what a point sees), the scope's sources light it with their
shadows, and light is followed from wall to wall until little is left. The mean of many
paths is right but for its noise, and the noise is told: this is what the fast bounce
light (`renderers.shading.bounce_light`) is judged by.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, GBuffer
from renderers.shading.bands import RowBands
from renderers.shading.illumination import ScopeLight
from renderers.shading.kernels.path_tracing import BatchPlan, SeenPoints, walk_rows
from renderers.shading.lit_walls import fibre_light, seen_field, wall_colour
from renderers.shading.wounds import WallBlood

BATCH_PATHS = 16
"""Paths of a pixel that share one lattice of first directions."""
SOURCES = 6
"""Fibre ends that stand for the two crescents, as in the finest tier."""
LONGEST_MM = 120.0
"""A path through air longer than this has left the nose."""


@dataclass(frozen=True, slots=True)
class PathLight:
    """An estimate of the light that arrives by way of other walls.

    irradiance: ``(h, w, 3)`` float32 red, green, blue, in the units of
        `ScopeLight.power` per mm^2; 0 where nothing is seen.
    standard_error: the same shape, one standard deviation of `irradiance`.
    paths: walked for each pixel, on average.
    batches: ``(h, w)`` independent parts of them behind each pixel, if known.
    """

    irradiance: NDArray[np.float32]
    standard_error: NDArray[np.float32]
    paths: int
    batches: NDArray[np.int32] | None = None

    def half_width(self, confidence: float) -> NDArray[np.float32]:
        """Return how far the truth may be off in that share of cases, ``(h, w, 3)``.

        Student's t: a few batches tell their own spread badly.
        """
        from scipy.special import stdtrit

        if not 0 < confidence < 1 or self.batches is None:
            raise ValueError(
                "an interval needs a confidence between 0 and 1 and the number of "
                f"batches, got {confidence} and {self.batches}"
            )
        freedom = np.maximum(self.batches - 1, 1).astype(np.float64)
        factor = stdtrit(freedom, 0.5 + confidence / 2)[..., None]
        return np.asarray(factor * self.standard_error, dtype=np.float32)

    def noise(self) -> float:
        """Return the root mean square error over the mean irradiance, all pixels."""
        mean = float(self.irradiance.mean())
        if mean == 0:
            return 0.0
        return math.sqrt(float((self.standard_error.astype(float) ** 2).mean())) / mean


@dataclass(frozen=True, slots=True)
class SeenWalls:
    """The places of one view that light is followed from.

    points: ``(h, w, 3)`` float32 mm from the eye, world axes. normals: of the G-buffer.
    shown: ``(h, w)`` where there is a wall. weight: ``(h, w, 3)`` what a unit of
    irradiance adds to the picture there; None for the same everywhere.
    """

    camera: Camera
    light: ScopeLight
    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    shown: NDArray[np.bool_]
    weight: NDArray[np.float32] | None = None

    @classmethod
    def of(
        cls,
        gbuffer: GBuffer,
        camera: Camera,
        light: ScopeLight,
        weight: NDArray[np.float32] | None = None,
    ) -> "SeenWalls":
        """Take them from a G-buffer of the camera's size."""
        require_size(gbuffer, camera)
        shown = (gbuffer.coverage > 0) & np.isfinite(gbuffer.depth_mm)
        depth = np.where(shown, gbuffer.depth_mm, 0)[..., None]
        points = (depth * (camera.lens_table() @ camera.frame[1:])).astype(np.float32)
        return cls(camera, light, points, gbuffer.normal, shown, weight)


class PathTracer:
    """Follow light through the air of one case.

    surface: distance, blood and skin. blood_bias: as of `ScopeShader`. bounces: walls
    a path meets at most; paths that carry little end by chance before, without bias.
    The same seed gives the same bits for any number of threads.
    """

    def __init__(
        self,
        surface: AirSurface,
        *,
        blood_bias: float = 1.0,
        bounces: int = 12,
        seed: int = 0,
        threads: int = 2,
    ) -> None:
        if bounces < 1:
            raise ValueError(f"a path needs at least one bounce, got {bounces}")
        if not (math.isfinite(blood_bias) and 0 <= blood_bias <= 10):
            raise ValueError(f"blood bias must be within 0..10, got {blood_bias}")
        self.surface = surface
        self._bounces = bounces
        self._seed = seed
        self._colour = wall_colour(surface, blood_bias, WallBlood(surface).codes)
        self._bands = RowBands(threads)

    def light(
        self,
        gbuffer: GBuffer,
        camera: Camera,
        light: ScopeLight,
        *,
        batches: int = 8,
    ) -> PathLight:
        """Walk batches of 16 paths a pixel; give what has come together."""
        if batches < 2:
            raise ValueError(f"noise is known from two batches on, got {batches}")
        walls = SeenWalls.of(gbuffer, camera, light)
        height, width = gbuffer.size
        total = np.zeros((height, width, 3))
        squares = np.zeros_like(total)
        for batch in range(batches):
            self.walk(walls, batch, (0, height, 0, width), total, squares)
        return estimate(walls, total, squares, np.full(gbuffer.size, batches, np.int32))

    def walk(
        self,
        walls: "SeenWalls",
        batch: int,
        block: tuple[int, int, int, int],
        total: NDArray[np.float64],
        squares: NDArray[np.float64],
    ) -> None:
        """Add one batch of paths to the sums of a block of pixels.

        batch: its number, which its random numbers hang on. block: top, bottom, left,
        right. total, squares: ``(h, w, 3)`` sums of batch means and of their squares.
        """
        surface, camera = self.surface, walls.camera
        top, bottom, left, right = block
        plan = BatchPlan(
            np.uint64(self._seed),
            batch,
            BATCH_PATHS,
            self._bounces,
            np.float32(LONGEST_MM),
        )
        seen = SeenPoints(walls.points, walls.normals, walls.shown)
        field = seen_field(surface.distance, camera)
        light = fibre_light(walls.light, camera, walls.light.sources(camera, SOURCES))

        def rows(first: int, last: int) -> None:
            walk_rows(
                seen,
                plan,
                field,
                light,
                self._colour,
                total,
                squares,
                left,
                right,
                top + first,
                top + last,
            )

        self._bands.run(bottom - top, rows)

    def close(self) -> None:
        """End the threads."""
        self._bands.close()


def require_size(gbuffer: GBuffer, camera: Camera) -> None:
    """Raise ValueError when a camera has another size than what it has seen."""
    if gbuffer.size != (camera.height, camera.width):
        raise ValueError(
            f"G-buffer of {gbuffer.size} does not fit a camera of "
            f"{(camera.height, camera.width)} (height, width)"
        )


def estimate(
    walls: SeenWalls,
    total: NDArray[np.float64],
    squares: NDArray[np.float64],
    batches: NDArray[np.int32],
) -> PathLight:
    """Turn sums of batch means into a mean and its error; batches: ``(h, w)``."""
    n = np.maximum(batches, 1)[..., None]
    mean = total / n
    spread = np.maximum(squares / n - mean * mean, 0) / np.maximum(n - 1, 1)
    unknown = walls.shown & (batches < 2)
    error = np.where(unknown[..., None], np.inf, np.sqrt(spread))
    seen = batches[walls.shown]
    paths = round(float(seen.mean()) * BATCH_PATHS) if seen.size else 0
    return PathLight(
        mean.astype(np.float32), error.astype(np.float32), paths, batches.copy()
    )
