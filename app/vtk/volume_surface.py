"""The surface of a volume at one density, as triangles drawn by VTK.

Users of a pilot of 1998 preferred such a surface to a volume (Rudman et al.,
Laryngoscope 108:1643, 1998); it is there beside the volume, from the same eye.
"""

import math
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from paravol.volume.look import VolumeLook
from renderers.scene import Camera, Projection, Volume
from system import UserError

MOST_VOXELS = 12_000_000
"""A larger volume is not taken at every voxel: without a graphics card each picture of
a surface of millions of triangles would take a second."""

COARSE_VOXELS = 1_000_000
"""A coarse surface is that of every few voxels, so that there are fewer than this: it
is there in a moment, and turns more quickly without a graphics card."""

GROUND = "#0d1117"


class SurfaceDrawer:
    """Draw surfaces. It belongs to the thread that draws first, as OpenGL does."""

    def __init__(self) -> None:
        self._plotter: Any = None
        self._kept: dict[bool, tuple[int, float]] = {}
        self._actors: dict[bool, Any] = {}

    def has(self, volume: Volume, look: VolumeLook) -> bool:
        """Return whether the fine surface is there already."""
        return self._kept.get(False) == (id(volume), look.surface)

    def draw(
        self,
        volume: Volume,
        look: VolumeLook,
        colour: str,
        camera: Camera,
        *,
        is_coarse: bool = False,
    ) -> NDArray[np.uint8]:
        """Return the picture ``(h, w, 3)`` uint8 sRGB.

        colour: of the surface, ``#rrggbb``. is_coarse: of few of the voxels. Raises
        UserError where the volume nowhere has the density, or for a lens that VTK has
        not.
        """
        if camera.projection is not Projection.PERSPECTIVE:
            raise UserError("a surface is drawn with a pinhole only")
        plotter = self._opened()
        key = id(volume), look.surface
        if key != self._kept.get(is_coarse):
            most = COARSE_VOXELS if is_coarse else MOST_VOXELS
            mesh = contour(volume, look.surface, most)
            if not mesh.n_points:
                raise UserError(
                    f"Nothing of this scan has the density {look.surface:g}; move the "
                    "surface's density into the histogram."
                )
            if is_coarse in self._actors:
                plotter.remove_actor(self._actors[is_coarse], render=False)
            actor = plotter.add_mesh(mesh, color=colour, render=False)
            # with the normals that it has: pyvista would make them anew
            actor.prop.interpolation = "Phong"
            self._actors[is_coarse], self._kept[is_coarse] = actor, key
        for kind, actor in self._actors.items():
            actor.visibility = kind is is_coarse
        surface = self._actors[is_coarse].prop
        surface.color = colour
        # VTK's lights sum to about one, those of the volume to look.diffuse
        surface.ambient, surface.diffuse = look.ambient, min(look.diffuse, 1.0)
        surface.specular, surface.specular_power = min(look.specular, 1.0), 16.0
        plotter.window_size = [camera.width, camera.height]
        place(plotter.camera, camera)
        plotter.renderer.reset_camera_clipping_range()
        picture: NDArray[np.uint8] = plotter.screenshot(return_img=True)
        return np.ascontiguousarray(picture[..., :3])

    def close(self) -> None:
        """Give the graphics memory back."""
        if self._plotter is not None:
            self._plotter.close()
        self._plotter = None
        self._kept, self._actors = {}, {}

    def _opened(self) -> Any:
        if self._plotter is None:
            self._plotter = pv.Plotter(off_screen=True, lighting="light kit")
            self._plotter.renderer.set_background(GROUND)
        return self._plotter


def contour(volume: Volume, density: float, most: int = MOST_VOXELS) -> Any:
    """Return the triangles at a density, in patient LPS mm, with normals.

    most: voxels; of a larger volume every second, third... is taken along each axis.
    """
    step = math.ceil(max(volume.values.size / most, 1.0) ** (1.0 / 3.0))
    values = np.asarray(volume.values)[::step, ::step, ::step]
    nz, ny, nx = values.shape
    grid: Any = pv.ImageData(dimensions=(nx, ny, nz), spacing=(step, step, step))
    grid.point_data["density"] = np.ascontiguousarray(values, np.float32).ravel()
    mesh: Any = grid.contour(
        [density], scalars="density", compute_normals=False, method="flying_edges"
    )
    if not mesh.n_points:
        return mesh
    # contoured in voxels and placed here: no axis can be lost on the way
    matrix = volume.world_from_voxel
    mesh.points = np.asarray(mesh.points, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    mesh.clear_data()
    # a contour's triangles agree already: to make them agree takes eight times as long
    return mesh.compute_normals(
        auto_orient_normals=False, split_vertices=False, consistent_normals=False
    )


def place(eye: Any, camera: Camera) -> None:
    """Let a VTK camera see what a pinhole of ours sees."""
    position, _, up, forward = np.asarray(camera.frame, np.float64)
    eye.position = tuple(position)
    eye.focal_point = tuple(position + forward)
    eye.up = tuple(up)
    # VTK counts along the height
    share = camera.height / min(camera.width, camera.height)
    eye.view_angle = 2.0 * math.degrees(math.atan(math.tan(camera.extent) * share))
