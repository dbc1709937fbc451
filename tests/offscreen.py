"""VTK windows without a screen, for tests that read back what VTK draws."""

import subprocess
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkWindowToImageFilter,
)

from renderers.scene import Camera, Projection

_PROBE = (
    "from vtkmodules.vtkRenderingCore import vtkRenderWindow;"
    "import vtkmodules.vtkRenderingOpenGL2;"
    "w = vtkRenderWindow(); w.SetOffScreenRendering(1); w.SetSize(8, 8);"
    "w.Render(); raise SystemExit(0 if w.SupportsOpenGL() else 1)"
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


def make_window(view: Camera) -> tuple[vtkRenderWindow, vtkRenderer]:
    """Open a window of a camera's size that looks as it does."""
    renderer = vtkRenderer()
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(view.width, view.height)
    window.AddRenderer(renderer)
    aim(renderer, view)
    return window, renderer


def aim(renderer: vtkRenderer, view: Camera) -> None:
    """Look as a camera does."""
    eye = renderer.GetActiveCamera()
    eye.SetPosition(*view.eye_mm)
    eye.SetFocalPoint(*(view.eye_mm + view.frame[3]))
    eye.SetViewUp(*view.frame[2])
    if view.projection is Projection.ORTHOGRAPHIC:
        eye.ParallelProjectionOn()
        eye.SetParallelScale(view.extent)
    eye.SetViewAngle(np.degrees(2 * view.extent))
    renderer.ResetCameraClippingRange()


def grab(window: vtkRenderWindow, depth: bool = False) -> NDArray[Any]:
    """Draw and read back: sRGB bytes ``(h, w, 3)``, or the depth buffer ``(h, w)``."""
    window.Render()
    source = vtkWindowToImageFilter()
    source.SetInput(window)
    source.ReadFrontBufferOff()
    if depth:
        source.SetInputBufferTypeToZBuffer()
    source.Update()
    convert: Any = vtk_to_numpy
    flat: NDArray[Any] = convert(source.GetOutput().GetPointData().GetScalars())
    width, height = window.GetSize()
    shape = (height, width) if depth else (height, width, 3)
    return flat.reshape(shape)[::-1].copy()


def ball(
    middle: NDArray[np.float64], radius: float, color: tuple[float, float, float]
) -> vtkActor:
    """Make a ball of one colour, without light."""
    source = vtkSphereSource()
    source.SetCenter(*middle)
    source.SetRadius(radius)
    source.SetThetaResolution(200)
    source.SetPhiResolution(200)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(source.GetOutputPort())
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*color)
    actor.GetProperty().LightingOff()
    return actor
