"""A picture made on the processor, shown inside a VTK scene with its own depth.

The picture hangs in front of the camera that it was made for, and each of its pixels
says how far away it really is: props of the scene are in front of or behind it pixel by
pixel. A pinhole only: VTK has no other lens.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkFloatArray, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkImageData, vtkPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkTexture

# the OpenGL factories register themselves on import, without opening anything
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLPolyDataMapper

from renderers.scene import Camera, Projection
from system import UserError

DEPTH_STEPS = 256**3 - 1
"""Depth is handed over in three bytes: steps of 8 nanometres at 130 mm."""

_DEPTH = """
vec4 far = texture(depths, tcoordVCVSOutput);
float code = dot(floor(far.rgb * 255.0 + 0.5), vec3(65536.0, 256.0, 1.0));
if (code > 16777214.5) discard;
vec4 place = MCDCMatrix * vec4(eye + forward * (code / 16777215.0 * reach), 1.0);
gl_FragDepth = 0.5 * place.z / place.w + 0.5;
"""

_COLOR = "gl_FragData[0] = vec4(texture(colors, tcoordVCVSOutput).rgb, 1.0);\n"


class PictureActor(vtkActor):
    """Show pictures with depth; replace them with `show` from frame to frame."""

    def __init__(self) -> None:
        super().__init__()
        # without a picture it has nothing to be drawn with
        self.VisibilityOff()
        self._corners = vtkPoints()
        self._corners.SetNumberOfPoints(4)
        square = vtkPolyData()
        square.SetPoints(self._corners)
        cells = vtkCellArray()
        cells.InsertNextCell(4, (0, 1, 2, 3))
        square.SetPolys(cells)
        places = vtkFloatArray()
        places.SetNumberOfComponents(2)
        for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)):
            places.InsertNextTuple2(u, v)
        square.GetPointData().SetTCoords(places)
        self._square = square
        mapper = vtkOpenGLPolyDataMapper()
        mapper.SetInputData(square)
        # the matrix is for places in the world as they are
        mapper.SetVBOShiftScaleMethod(0)
        self.SetMapper(mapper)
        self.GetProperty().LightingOff()
        self._textures = {name: _texture() for name in ("colors", "depths")}
        for name, texture in self._textures.items():
            self.GetProperty().SetTexture(name, texture)
        shader = self.GetShaderProperty()
        declared = "uniform mat4 MCDCMatrix;\n//VTK::TCoord::Dec"
        shader.AddFragmentShaderReplacement("//VTK::TCoord::Dec", True, declared, False)
        shader.AddFragmentShaderReplacement("//VTK::TCoord::Impl", True, _COLOR, False)
        shader.AddFragmentShaderReplacement("//VTK::Depth::Impl", True, _DEPTH, False)

    def show(
        self, pixels: NDArray[np.uint8], depth_mm: NDArray[np.float32], camera: Camera
    ) -> None:
        """Replace the picture.

        pixels: ``(h, w, 3)`` sRGB. depth_mm: ``(h, w)`` along the rays, infinite where
        the scene behind is to be seen. Raises UserError for sizes that do not fit or
        a camera that is no pinhole.
        """
        if camera.projection is not Projection.PERSPECTIVE:
            raise UserError(
                "VTK shows pinhole pictures only; draw this one with a perspective "
                f"camera, not with projection {camera.projection.name.lower()}"
            )
        size = camera.height, camera.width
        if pixels.shape != (*size, 3) or depth_mm.shape != size:
            raise UserError(
                f"pixels {pixels.shape} and depths {depth_mm.shape} do not fit a "
                f"camera of {camera.width} x {camera.height} pixels"
            )
        axis_mm = depth_mm * camera.lens_table()[..., 2]
        seen = np.isfinite(axis_mm)
        reach = float(np.max(axis_mm, where=seen, initial=1e-3)) * 1.001
        code = np.where(seen, np.where(seen, axis_mm, 0) / reach, 1) * DEPTH_STEPS
        code = np.rint(code.astype(np.float64)).astype(np.uint32)
        code[seen] = np.minimum(code[seen], DEPTH_STEPS - 1)
        packed = np.stack([code >> 16, code >> 8 & 255, code & 255], axis=-1)
        _fill(self._textures["colors"], pixels)
        _fill(self._textures["depths"], packed.astype(np.uint8))
        middle = float(np.mean(axis_mm, where=seen)) if seen.any() else 1.0
        self._hang(camera, middle)
        uniforms = self.GetShaderProperty().GetFragmentCustomUniforms()
        uniforms.SetUniform3f("eye", camera.eye_mm.tolist())
        uniforms.SetUniform3f("forward", camera.frame[3].tolist())
        uniforms.SetUniformf("reach", reach)
        self.VisibilityOn()

    def _hang(self, camera: Camera, distance_mm: float) -> None:
        """Put the square where it fills the camera's view."""
        eye, right, up, forward = camera.frame
        slope = np.tan(camera.extent) * distance_mm
        half = min(camera.width, camera.height)
        across = right * slope * camera.width / half
        along = up * slope * camera.height / half
        middle = eye + forward * distance_mm
        for n, (a, b) in enumerate(((-1, -1), (1, -1), (1, 1), (-1, 1))):
            self._corners.SetPoint(n, *(middle + a * across + b * along))
        self._corners.Modified()
        self._square.Modified()


def _texture() -> vtkTexture:
    texture = vtkTexture()
    texture.SetColorModeToDirectScalars()
    texture.InterpolateOff()
    texture.MipmapOff()
    texture.RepeatOff()
    texture.SetInputData(vtkImageData())
    return texture


def _fill(texture: vtkTexture, pixels: NDArray[np.uint8]) -> None:
    """Hand ``(h, w, 3)`` bytes over; VTK's first row is the lowest."""
    height, width = pixels.shape[:2]
    image = vtkImageData()
    image.SetDimensions(width, height, 1)
    convert: Any = numpy_to_vtk
    flat = np.ascontiguousarray(pixels[::-1]).reshape(-1, 3)
    image.GetPointData().SetScalars(convert(flat, deep=True))
    texture.SetInputData(image)
