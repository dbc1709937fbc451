"""The overview beside the endoscope's picture: translucent head, tools, landmarks.

The head is many translucent layers: without a graphics card one picture of it takes a
tenth of a second, which the endoscope's picture needs. It changes only when it is
turned, so it is drawn once and then serves as the background of the tools.
"""

from collections.abc import Mapping

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from pyvista.plotting.plotter import BasePlotter
from vtkmodules.vtkRenderingCore import vtkTexture

from app.vtk.head_model import HeadModel
from app.vtk.picture_actor import PictureActor
from paravol.slices.cutaway import Cutaway
from renderers.fsr.actor import camera_of
from renderers.scene import Mesh
from scenarios import Endoscope, FrameState
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments import placed_tool

STEEL = "#d5dde5"
TOOL = "#7fb4ff"
LIGHT = "#ffe28a"
TARGET = "#ffd166"
TOUCHED = "#4cc9a0"
WANTED = "#ff5d73"
PAPER = "#c9d1d9"

CONE_MM = 14.0
"""Length of the cone that shows where the scope looks."""

HIGHEST_DEG = 85.0
VIEW_ANGLES_DEG = (4.0, 60.0)


class OverviewScene:
    """Keep the actors of the overview on a plotter, and move them.

    Only `picture` draws: a plotter that is given an actor would draw at once.
    """

    def __init__(
        self, plotter: BasePlotter, endoscope: Endoscope, background: str = "black"
    ) -> None:
        """Put the scope in; it stays hidden until `follow` places it."""
        self._plotter = plotter
        plotter.renderer.set_background(background)
        length = endoscope.shaft_length_mm
        shaft = pv.Cylinder(
            center=(0.0, 0.0, length / 2),
            direction=(0.0, 0.0, 1.0),
            radius=endoscope.diameter_mm / 2,
            height=length,
            resolution=20,
        )
        half = np.radians(endoscope.field_of_view_deg / 2)
        cone = pv.Cone(
            center=(0.0, 0.0, CONE_MM / 2),
            direction=(0.0, 0.0, -1.0),
            height=CONE_MM,
            radius=CONE_MM * np.tan(half),
            capping=False,
            resolution=28,
        )
        tip = pv.Sphere(radius=endoscope.diameter_mm * 0.75)
        self._scope = [
            plotter.add_mesh(shaft, color=STEEL, specular=0.5, name="shaft"),
            plotter.add_mesh(tip, color=LIGHT, lighting=False, name="tip"),
        ]
        self._cone = plotter.add_mesh(
            cone, color=LIGHT, opacity=0.25, lighting=False, name="view"
        )
        self._tool: list[pv.Actor] = []
        self._tool_name = NO_TOOL
        self._head: pv.Prop3D | None = None
        self._cutaway: Cutaway | None = None
        self._opened = PictureActor()
        self._opened_from: tuple[object, ...] | None = None
        self._still: list[pv.Prop3D] = []
        self._frozen: tuple[object, ...] | None = None
        for actor in self._moving():
            actor.visibility = False

    def show_head(self, head: HeadModel) -> None:
        """Show the head and its landmarks, and turn the camera to them."""
        plotter = self._plotter
        self._head = plotter.add_mesh(
            head.mesh,
            scalars="rgba",
            rgb=True,
            name="head",
            pickable=False,
            render=False,
        )
        self._still.append(self._head)
        low, high = np.array(head.mesh.bounds).reshape(3, 2).T
        focus = np.stack([low, high]) if head.focus_mm is None else head.focus_mm
        middle = focus.mean(axis=0)
        if head.targets:
            self._label(
                {name.partition(",")[0]: p for name, p in head.targets.items()},
                TARGET,
                name="targets",
                points=True,
                font_size=12,
            )
        plotter.camera.focal_point = middle
        plotter.camera.position = middle + np.array([-250.0, -150.0, 70.0])
        plotter.camera.up = (0.0, 0.0, 1.0)
        plotter.camera.view_angle = 26.0
        plotter.renderer.ResetCamera(focus.T.ravel().tolist())
        # The camera fits the sphere round the box; the head fills less.
        plotter.camera.Zoom(1.55)
        # Otherwise the first picture would place it anew.
        plotter.renderer.camera_set = True

    def renew_head(self, mesh: pv.PolyData) -> None:
        """Show another mesh of the same head, cut or put back; all else stays."""
        before = self._head
        self._head = self._plotter.add_mesh(
            mesh,
            scalars="rgba",
            rgb=True,
            name="head",
            pickable=False,
            reset_camera=False,
            render=False,
        )
        self._still = [
            self._head if actor is before else actor for actor in self._still
        ]
        self._frozen = None
        self._thaw()
        self._head.SetVisibility(not self.is_open)

    def show_fiducials(
        self, fiducials: Mapping[str, NDArray[np.float64]], touched: int
    ) -> None:
        """Mark the divots of the mock head: done, next, still to come."""
        for number, (name, position) in enumerate(fiducials.items()):
            colour = TOUCHED if number < touched else PAPER
            self._plotter.add_mesh(
                pv.Sphere(radius=2.4 if number == touched else 1.6, center=position),
                color=WANTED if number == touched else colour,
                lighting=False,
                name=f"fiducial {name}",
                reset_camera=False,
                render=False,
            )

    def hide_fiducials(self, fiducials: Mapping[str, NDArray[np.float64]]) -> None:
        """Take the divots away."""
        for name in fiducials:
            self._plotter.renderer.remove_actor(f"fiducial {name}", render=False)

    def follow(self, view: FrameState) -> None:
        """Move the tools to where a view has them."""
        for actor in self._scope:
            actor.user_matrix = view.world_from_tip
        eye, right, up, forward = view.camera.frame
        looking = np.eye(4)
        looking[:3] = np.stack([right, up, forward, eye], axis=1)
        self._cone.user_matrix = looking
        tool = placed_tool(view.instrument, view.world_from_instrument, view.jaw)
        if view.instrument != self._tool_name:
            self._take(view.instrument, [mesh for mesh, _ in tool])
        for actor, (_, pose) in zip(self._tool, tool, strict=True):
            actor.user_matrix = pose
        for actor in self._moving():
            actor.visibility = True

    def _take(self, name: str, parts: list[Mesh]) -> None:
        """Show another tool in place of the one before."""
        for actor in self._tool:
            self._plotter.remove_actor(actor, render=False)
        self._tool_name = name
        self._tool = [
            self._plotter.add_mesh(
                pv.PolyData.from_regular_faces(part.vertices, part.faces.astype(int)),
                color=TOOL,
                specular=0.5,
                smooth_shading=True,
                split_sharp_edges=True,
                name=f"tool part {number}",
                reset_camera=False,
                render=False,
            )
            for number, part in enumerate(parts)
        ]

    def turn(self, azimuth_deg: float, elevation_deg: float) -> None:
        """Move the camera round the head; it never goes over the vertex."""
        camera = self._plotter.camera
        camera.Azimuth(azimuth_deg)
        direction = np.subtract(camera.position, camera.focal_point)
        height = np.degrees(np.arcsin(direction[2] / np.linalg.norm(direction)))
        wanted = np.clip(height + elevation_deg, -HIGHEST_DEG, HIGHEST_DEG)
        camera.Elevation(wanted - height)

    def zoom(self, factor: float) -> None:
        """Narrow the view by a factor above 1, widen it by one below."""
        camera = self._plotter.camera
        low, high = VIEW_ANGLES_DEG
        camera.view_angle = min(max(camera.view_angle / factor, low), high)

    @property
    def picture_axes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return where the picture's right and up lie in the patient, ``(3,)`` each."""
        camera = self._plotter.camera
        forward = np.subtract(camera.focal_point, camera.position)
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, camera.up)
        right /= np.linalg.norm(right)
        return right, np.cross(right, forward)

    @property
    def is_open(self) -> bool:
        """Return whether the head is shown cut open."""
        return self._cutaway is not None

    def open_head(self, cutaway: Cutaway | None) -> None:
        """Show the head cut open, from its open side; None shows it whole again."""
        was_open, self._cutaway = self.is_open, cutaway
        self._opened_from = self._frozen = None
        self._thaw()
        if self._head is not None:
            self._head.SetVisibility(cutaway is None)
        if cutaway is None:
            self._plotter.renderer.RemoveActor(self._opened)
        elif not was_open:
            self._plotter.renderer.AddActor(self._opened)
            camera = self._plotter.camera
            target = np.array(camera.focal_point)
            side = np.array([cutaway.towards, -0.35, 0.12])
            side *= np.linalg.norm(camera.position - target) / np.linalg.norm(side)
            camera.position = target + side
            camera.up = (0.0, 0.0, 1.0)

    def picture(self) -> NDArray[np.uint8]:
        """Draw the scene as it is now, ``(h, w, 3)`` sRGB."""
        if self._cutaway is None:
            self._freeze()
        else:
            self._open()
        return self._picture()

    def _open(self) -> None:
        """Draw the opened head anew where the camera has moved."""
        seen = self._standpoint()
        if seen == self._opened_from or self._cutaway is None:
            return
        view = camera_of(self._plotter.renderer)
        self._opened.show(*self._cutaway.draw(view), view)
        self._opened_from = seen

    def _standpoint(self) -> tuple[object, ...]:
        camera = self._plotter.camera
        return (
            camera.position,
            camera.focal_point,
            camera.up,
            camera.view_angle,
            *self._plotter.window_size,
        )

    def _picture(self) -> NDArray[np.uint8]:
        self._plotter.renderer.ResetCameraClippingRange()
        # A screenshot alone would show again what was drawn last.
        self._plotter.render()
        return np.asarray(self._plotter.screenshot(None, return_img=True))

    def _freeze(self) -> None:
        """Make what stands still the background, unless it is already."""
        seen = self._standpoint()
        if seen == self._frozen or not self._still:
            return
        visible = [
            actor
            for actor in self._plotter.renderer.actors.values()
            if actor not in self._still and actor.GetVisibility()
        ]
        self._thaw()
        for actor in visible:
            actor.SetVisibility(False)
        picture = self._picture()
        for actor in visible:
            actor.SetVisibility(True)
        for actor in self._still:
            actor.SetVisibility(False)
        height, width = picture.shape[:2]
        image = pv.ImageData(dimensions=(width, height, 1))
        # VTK counts rows from the bottom.
        image.point_data["rgb"] = picture[::-1].reshape(-1, 3)
        texture = vtkTexture()
        texture.SetInputData(image)
        self._plotter.renderer.SetBackgroundTexture(texture)
        self._plotter.renderer.SetTexturedBackground(True)
        self._frozen = seen

    def _thaw(self) -> None:
        """Draw what stands still by itself again."""
        self._plotter.renderer.SetTexturedBackground(False)
        for actor in self._still:
            actor.SetVisibility(True)

    def _moving(self) -> list[pv.Actor]:
        return [*self._scope, self._cone, *self._tool]

    def _label(
        self,
        places: Mapping[str, NDArray[np.float64]],
        colour: str,
        *,
        name: str,
        points: bool,
        font_size: int,
    ) -> None:
        labels = self._plotter.add_point_labels(
            np.stack(list(places.values())),
            list(places),
            text_color=colour,
            point_color=colour,
            point_size=8.0,
            render_points_as_spheres=True,
            show_points=points,
            font_size=font_size,
            bold=False,
            shape=None,
            always_visible=True,
            name=name,
            reset_camera=False,
            render=False,
        )
        self._still.append(labels)
