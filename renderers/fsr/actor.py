"""The display list as a VTK actor, for any pyvista or VTK scene.

Splats are drawn far to near by VTK's Gaussian points with plain alpha blending. VTK's
own order-independent blending must be off in the renderer that shows the actor
(`SplatActor.prepare`): it ignores the order, and far walls show through near ones.
"""

import subprocess
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkDataArray, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkRenderer

# the OpenGL factories register themselves on import, without opening anything
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLPointGaussianMapper

from renderers.fsr.display_list import build_display_list, sorted_by_distance
from renderers.fsr.footprint import CUT_SIGMAS, SIGMA_PER_SPACING, peak_table
from renderers.fsr.fuzzy_set import FuzzySet
from renderers.scene import Camera, Scene, srgb_from_linear

_PROBE = (
    "from vtkmodules.vtkRenderingCore import vtkRenderWindow;"
    "import vtkmodules.vtkRenderingOpenGL2;"
    "w = vtkRenderWindow(); w.SetOffScreenRendering(1); w.SetSize(8, 8);"
    "w.Render(); raise SystemExit(0 if w.SupportsOpenGL() else 1)"
)

_FOOTPRINT = (
    "//VTK::Color::Impl\n"
    "float r2 = dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy);\n"
    "if (r2 > {cut2:.1f}) discard;\n"
    "float edge = exp(-0.5 * {cut2:.1f});\n"
    "opacity *= (exp(-0.5 * r2) - edge) / (1.0 - edge);\n"
)


def opengl_works(timeout_s: float = 60.0) -> bool:
    """Try an off-screen window in a child process.

    Without an OpenGL library VTK ends the process that opens one, so never this one.
    """
    try:
        child = subprocess.run(
            [sys.executable, "-c", _PROBE],
            timeout=timeout_s,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False
    return child.returncode == 0


class SplatActor(vtkActor):
    """Show a fuzzy set; call `update` whenever the camera has moved.

    Colours and opacities are those of mode `classic`, encoded for the screen, since
    VTK blends what it shows. Sizes are those of perspective projection.
    """

    def __init__(self, fuzzy_set: FuzzySet, scene: Scene) -> None:
        super().__init__()
        self._rows = fuzzy_set.rows
        spacing = float(np.max(scene.volume.spacing_mm))
        self._margin = CUT_SIGMAS * SIGMA_PER_SPACING * spacing
        self._position = fuzzy_set.rows.centers_mm().astype(np.float32)
        self._rgba = _shade(fuzzy_set, scene, self._position)
        self._data = vtkPolyData()
        mapper = vtkOpenGLPointGaussianMapper()
        mapper.SetInputData(self._data)
        mapper.SetScaleFactor(SIGMA_PER_SPACING * spacing)
        mapper.SetBoundScale(CUT_SIGMAS)
        mapper.SetSplatShaderCode(_FOOTPRINT.format(cut2=CUT_SIGMAS**2))
        mapper.EmissiveOff()
        mapper.SetScalarModeToUsePointData()
        mapper.SetColorModeToDirectScalars()
        self.SetMapper(mapper)
        self.ForceTranslucentOn()
        self.GetProperty().LightingOff()
        self.drawn = 0

    @staticmethod
    def prepare(renderer: vtkRenderer) -> None:
        """Make a renderer blend in drawing order."""
        renderer.SetUseOIT(False)

    def update(self, camera: Camera) -> None:
        """Cull and order for a view; positions and colours stay as they are."""
        shown = build_display_list(self._rows, camera, self._margin)
        index = sorted_by_distance(shown, self._rows, camera).index
        points = vtkPoints()
        points.SetData(_copied(self._position[index]))
        colors = _copied(self._rgba[index])
        self._data.SetPoints(points)
        self._data.GetPointData().SetScalars(colors)
        self._data.Modified()
        self.drawn = len(index)


def _copied(array: NDArray[Any]) -> vtkDataArray:
    convert: Any = numpy_to_vtk
    result: vtkDataArray = convert(array, deep=True)
    return result


def _shade(
    fuzzy_set: FuzzySet, scene: Scene, position: NDArray[np.float32]
) -> NDArray[np.uint8]:
    """Give straight sRGB and opacity bytes ``(n, 4)``."""
    color, kappa = scene.transfer_function.evaluate(fuzzy_set.value.astype(np.float64))
    normal = fuzzy_set.normals().astype(np.float64)
    material = scene.material
    light = np.full((len(fuzzy_set), 3), material.ambient)
    for source in scene.lights:
        towards = np.broadcast_to(source.vector, normal.shape)
        if source.is_local:
            towards = source.vector - position
            length = np.linalg.norm(towards, axis=1, keepdims=True)
            towards = towards / np.maximum(length, 1e-9)
        facing = np.maximum((normal * towards).sum(axis=1, keepdims=True), 0)
        light = light + material.diffuse * facing * source.color
    light[~np.any(normal, axis=1)] = 1.0
    length_mm = float(np.prod(scene.volume.spacing_mm) ** (1 / 3))
    sheet = -np.expm1(-kappa * length_mm)
    table = peak_table(1024)
    peak = np.interp(sheet, np.linspace(0, 1, len(table)), table)
    rgba = np.concatenate([srgb_from_linear(color * light), peak[:, None]], axis=1)
    encoded: NDArray[np.uint8] = (rgba * 255 + 0.5).astype(np.uint8)
    return encoded
