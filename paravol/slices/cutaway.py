"""The head opened from the side: a picture with depth, made on the processor.

Everything on one side of a sagittal plane is taken away. The plane shows the scan, the
airway behind it its walls, and what stands in the airway is hidden by them pixel by
pixel, since the picture brings its depth (see `app.vtk.picture_actor`).
"""

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from devices import ProbePath
from paravol.patient import PatientScene
from renderers.fsr import FuzzySetRenderer
from renderers.scene import AirSurface, Camera, Scene, Volume, srgb_from_linear
from system import UserError

MARGIN_MM = 2.2
"""From the middle of the way into the head to the plane, towards the septum: the
passage stands open and its side wall is whole."""

MUCOSA = (0.55, 0.17, 0.15)
"""Linear albedo of the airway's wall."""

SCAN_HU = (-900.0, 1300.0)
"""Black and white of the scan on the plane."""

SCAN_TINT = (0.95, 0.88, 0.82)

LEAST_HU = -500.0
"""What is darker on the plane is air beside a wall that just touches it."""

ON_PLANE_MM = 0.35
AMBIENT, FROM_EYE, FROM_ABOVE = 0.15, 0.45, 0.4
DEEP_MM = 16.0
"""Walls that lie so far behind the plane have 1/e of the light."""


class Cutaway:
    """Draw one head without what lies on one side of a plane across x.

    May be made in any thread; takes a second or two.
    """

    def __init__(
        self, scene: Scene, way_mm: Iterable[NDArray[np.float64]], threads: int = 1
    ) -> None:
        """Cut beside a way into the head, on the side of the patient's middle.

        way_mm: places ``(3,)`` of the way, world. Raises UserError for a scene
        without an air surface or a way of no place.
        """
        surface = scene.surface
        if surface is None:
            raise UserError("only a scene with an air surface can be cut open")
        places = np.array(list(way_mm), np.float64).reshape(-1, 3)
        if not len(places):
            raise UserError("a head is cut open along a way, which has no place")
        beside = float(np.median(places[:, 0]))
        middle = float(surface.distance.center_mm[0])
        self.towards = 1.0 if middle >= beside else -1.0
        """Sign of x on the open side."""
        self.plane_mm = beside + self.towards * MARGIN_MM
        self._volume = scene.volume
        opened = opened_distance(surface.distance, self.plane_mm, self.towards)
        cut = AirSurface(opened, surface.blood, surface.skin)
        self._renderer = FuzzySetRenderer(
            Scene(scene.volume, scene.transfer_function, surface=cut), threads=threads
        )

    def draw(self, camera: Camera) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return sRGB pixels ``(h, w, 3)`` and depths ``(h, w)`` along the rays, mm.

        Light comes from the eye and from above. Depth is infinite where nothing is met.
        """
        buffer = self._renderer.gbuffer(camera)
        origin, ray = camera.rays()
        met = np.isfinite(buffer.depth_mm) & (buffer.coverage > 0)
        places = origin[met] + buffer.depth_mm[met, None].astype(np.float64) * ray[met]
        on_plane = np.abs(places[:, 0] - self.plane_mm) < ON_PLANE_MM
        on_plane &= np.abs(buffer.normal[met][:, 0]) > 0.9
        hu = self._scan_hu(places[on_plane])
        on_plane[on_plane] = hu > LEAST_HU
        low, high = SCAN_HU
        grey = np.clip((hu[hu > LEAST_HU] - low) / (high - low), 0.02, 1) ** 2.2
        albedo = np.tile(np.array(MUCOSA), (len(places), 1))
        albedo[on_plane] = grey[:, None] * np.array(SCAN_TINT)
        normal = buffer.normal[met]
        facing = np.clip(-(normal * ray[met]).sum(axis=1), 0, 1)
        light = AMBIENT + FROM_EYE * facing + FROM_ABOVE * np.clip(normal[:, 2], 0, 1)
        light *= np.exp(-np.abs(places[:, 0] - self.plane_mm) / DEEP_MM)
        light[on_plane] = 1.0
        linear = np.zeros((*buffer.size, 3), np.float32)
        linear[met] = albedo * light[:, None]
        depth = np.where(met, buffer.depth_mm, np.float32(np.inf))
        return np.rint(255 * srgb_from_linear(linear)).astype(np.uint8), depth

    def close(self) -> None:
        """End the threads."""
        self._renderer.close()

    def _scan_hu(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Look the scan up just inside the plane."""
        inside = places.copy()
        inside[:, 0] = self.plane_mm - self.towards * 0.1
        m = self._volume.voxel_from_world
        voxel = inside @ m[:3, :3].T + m[:3, 3]
        hu: NDArray[np.float64] = map_coordinates(
            self._volume.values, voxel.T[::-1], order=1, mode="nearest", output=float
        )
        return hu


def opened_distance(distance: Volume, plane_mm: float, towards: float) -> Volume:
    """Return the signed distance of what is left behind a plane across x, air outside.

    distance: mm, negative in air. towards: sign of x where all becomes air. Exact
    within the voxels beside the new surface, as surfels need it.
    """
    m = distance.world_from_voxel
    nz, ny, nx = distance.shape
    x_mm = (
        m[0, 0] * np.arange(nx)
        + m[0, 1] * np.arange(ny)[:, None]
        + m[0, 2] * np.arange(nz)[:, None, None]
        + m[0, 3]
    )
    left = (-towards * (x_mm - plane_mm)).astype(np.float32)
    return distance.with_values(np.minimum(distance.values, left), distance.background)


def cutter(patient: PatientScene, path: ProbePath) -> Callable[[], Cutaway]:
    """Prepare to cut a head open beside the way that a scope takes into it."""
    if patient.way_in is not None:
        way = patient.way_in
        steps = np.linspace(0, way.free_mm, 20)[:, None]
        return partial(Cutaway, patient.scene, way.pivot_mm + steps * way.axis)
    times = np.linspace(0, path.duration_s, 50)
    return partial(Cutaway, patient.scene, [path.sample(t).tip_mm for t in times])
