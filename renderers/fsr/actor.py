"""Splats as a VTK actor, for any pyvista or VTK scene.

Splats are drawn far to near by VTK's Gaussian points with plain alpha blending; then
their opaque middles once more, for the depth alone. VTK's own order-independent
blending must be off in the renderer that shows the actor (`SplatActor.show_in`): it
ignores the order, and far walls show through near ones.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import (
    vtkCommand,
    vtkDataArray,
    vtkInformation,
    vtkPoints,
)
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkRenderer

# the OpenGL factories register themselves on import, without opening anything
from vtkmodules.vtkRenderingOpenGL2 import (
    vtkOpenGLActor,
    vtkOpenGLPointGaussianMapper,
)

from renderers.fsr.fuzzy_set import FuzzySet
from renderers.fsr.kernels.footprint import CUT, SIGMA_PER_SPACING
from renderers.fsr.splats.set_view import SplatMode, view_set
from renderers.fsr.splats.shaded_set import ShadedSet
from renderers.fsr.splats.splat_list import far_to_near, list_splats
from renderers.scene import Camera, Projection, Scene, srgb_from_linear

_FOOTPRINT = (
    "//VTK::Color::Impl\n"
    "float r2 = dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy);\n"
    "if (r2 > {cut2:.1f}) discard;\n"
    "float edge = exp(-0.5 * {cut2:.1f});\n"
    "opacity *= (exp(-0.5 * r2) - edge) / (1.0 - edge);\n"
)

_MIDDLE = (
    "//VTK::Color::Impl\n"
    "float r2 = dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy);\n"
    "if (r2 > 2.0 || opacity < {least:.2f}) discard;\n"
    # less than half a code: the colours stay; with none VTK drops the fragment
    "opacity = 0.001;\n"
)

LEAST_PEAK = 0.25
"""Splats with less opaque middles leave no depth: a few of them in a row are clear."""


class SplatActor(vtkActor):
    """Show a fuzzy set; `show_in` keeps its order with the camera.

    Colours and opacities are those of mode `classic`, encoded for the screen, since
    VTK blends what it shows. Sizes are those of perspective projection.

    drawn: splats in the last view. reordered: how many times their order was found
    anew. Positions and colours are handed over once.
    """

    def __init__(self, fuzzy_set: FuzzySet, scene: Scene) -> None:
        super().__init__()
        if not (isinstance(fuzzy_set, FuzzySet) and isinstance(scene, Scene)):
            raise TypeError(
                "an actor takes splats and the scene that lights them, got "
                f"{type(fuzzy_set).__name__} and {type(scene).__name__}: call "
                "SplatActor(extract_fuzzy_set(scene), scene)"
            )
        self._shaded = ShadedSet(fuzzy_set, scene)
        position = fuzzy_set.rows.centers_mm().astype(np.float32)
        colors = _encoded(self._shaded.straight_rgba())
        self.data = vtkPolyData()
        points = vtkPoints()
        points.SetData(_copied(position))
        self.data.SetPoints(points)
        self.data.GetPointData().SetScalars(_copied(colors))
        self.data.SetVerts(_cells(np.arange(len(position))))
        sigma = SIGMA_PER_SPACING * self._shaded.widest_mm
        self.depth_part = vtkActor()
        self.depth_part.PickableOff()
        keys = vtkInformation()
        keys.Set(vtkOpenGLActor.GLDepthMaskOverride(), 1)
        self.depth_part.SetPropertyKeys(keys)
        middle = _MIDDLE.format(least=LEAST_PEAK)
        _draw_points(self, self.data, sigma, _FOOTPRINT.format(cut2=CUT**2))
        _draw_points(self.depth_part, self.data, sigma, middle)
        self.drawn = 0
        self.reordered = 0
        self._seen: NDArray[np.float64] = np.full(16, np.nan)

    @staticmethod
    def prepare(renderer: vtkRenderer) -> None:
        """Make a renderer blend in drawing order."""
        renderer.SetUseOIT(False)

    def show_in(self, renderer: vtkRenderer) -> None:
        """Add it to a renderer if need be, and follow its camera between pictures.

        Adds `depth_part`, too, which writes the depth of its opaque middles.
        """
        self.prepare(renderer)
        for actor in (self, self.depth_part):
            if not renderer.HasViewProp(actor):
                renderer.AddActor(actor)
        renderer.AddObserver(vtkCommand.StartEvent, self._follow)
        self._follow(renderer, "")

    def update(self, camera: Camera) -> None:
        """Cull and sort for a view; positions and colours stay as they are."""
        seen = view_set(self._shaded, camera, SplatMode.GAUSSIAN)
        index = far_to_near(list_splats(seen, seen.all_tiles))
        self.data.SetVerts(_cells(_hidden_first(index, len(self._shaded))))
        self.data.Modified()
        self.drawn = len(index)
        self.reordered += 1

    def _follow(self, renderer: vtkRenderer, event: str) -> None:
        width, height = renderer.GetSize()
        if width < 1 or height < 1:
            return
        camera = camera_of(renderer)
        lens = camera.extent, width, height, camera.projection
        seen = np.array([*camera.frame.ravel(), *lens], dtype=np.float64)
        # reading a window back changes its view angle in the eighth digit
        if not np.allclose(seen, self._seen, rtol=1e-6, atol=1e-9):
            self._seen = seen
            self.update(camera)


def camera_of(renderer: vtkRenderer) -> Camera:
    """Return the view of a renderer's camera, for its present size in pixels."""
    eye = renderer.GetActiveCamera()
    width, height = renderer.GetSize()
    forward = np.array(eye.GetDirectionOfProjection())
    right = np.cross(forward, eye.GetViewUp())
    right /= np.linalg.norm(right)
    position = np.array(eye.GetPosition())
    frame = np.stack([position, right, np.cross(right, forward), forward])
    # VTK counts along the height, or along the width when told so
    along = width if eye.GetUseHorizontalViewAngle() else height
    share = min(width, height) / along
    if eye.GetParallelProjection():
        extent = eye.GetParallelScale() * min(width, height) / height
        return Camera(frame, extent, width, height, Projection.ORTHOGRAPHIC)
    extent = math.atan(math.tan(math.radians(eye.GetViewAngle() / 2)) * share)
    return Camera(frame, extent, width, height, Projection.PERSPECTIVE)


def _draw_points(
    actor: vtkActor, data: vtkPolyData, sigma_mm: float, code: str
) -> None:
    """Let an actor draw points as billboards by some shader code."""
    mapper = vtkOpenGLPointGaussianMapper()
    mapper.SetInputData(data)
    mapper.SetScaleFactor(sigma_mm)
    mapper.SetBoundScale(CUT)
    mapper.SetSplatShaderCode(code)
    mapper.EmissiveOff()
    mapper.SetScalarModeToUsePointData()
    mapper.SetColorModeToDirectScalars()
    actor.SetMapper(mapper)
    actor.ForceTranslucentOn()
    actor.GetProperty().LightingOff()


def _hidden_first(index: NDArray[np.int32], count: int) -> NDArray[np.int64]:
    """Put those of `count` splats that a view leaves out before its own.

    VTK makes room for as many points as it is told to draw, then fills in all there
    are: with fewer it writes beyond what it has (9.7.2). What is left out lies outside
    the view, so that nothing of it is seen.
    """
    hidden = np.ones(count, np.bool_)
    hidden[index] = False
    return np.concatenate([np.flatnonzero(hidden), index])


def _cells(index: NDArray[np.int64]) -> vtkCellArray:
    """Make one vertex cell of every point in an order; VTK draws them as they come."""
    convert: Any = numpy_to_vtkIdTypeArray
    cells = vtkCellArray()
    n = len(index)
    cells.SetData(
        convert(np.arange(n + 1, dtype=np.int64), deep=True),
        convert(index.astype(np.int64), deep=True),
    )
    return cells


def _copied(array: NDArray[np.float32] | NDArray[np.uint8]) -> vtkDataArray:
    convert: Any = numpy_to_vtk
    result: vtkDataArray = convert(array, deep=True)
    return result


def _encoded(rgba: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return straight sRGB and opacity bytes ``(n, 4)``."""
    shown = np.concatenate([srgb_from_linear(rgba[:, :3]), rgba[:, 3:]], axis=1)
    encoded: NDArray[np.uint8] = (shown * 255 + 0.5).astype(np.uint8)
    return encoded
