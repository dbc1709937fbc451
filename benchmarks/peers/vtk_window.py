"""What both VTK peers share: an off-screen window and a camera."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util import numpy_support
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLRenderer  # noqa: F401

from benchmarks.peers.job_loop import Job
from benchmarks.peers.peer_process import Answer
from benchmarks.timing import measure

vtk_arrays: Any = numpy_support
"""Conversions between numpy and VTK; VTK gives them no types."""


class PeerWindow:
    """An off-screen window with one renderer on black."""

    def __init__(self) -> None:
        self.renderer = vtkRenderer()
        self.renderer.SetBackground(0, 0, 0)
        # Otherwise blending ignores the order of drawing, and far splats show
        # through near ones.
        self.renderer.SetUseOIT(False)
        self.renderer.SetAutomaticLightCreation(False)
        self.window = vtkRenderWindow()
        self.window.SetOffScreenRendering(True)
        self.window.SetMultiSamples(0)
        self.window.AddRenderer(self.renderer)

    def look(self, job: Job) -> None:
        """Take picture size and pinhole from a job.

        `frame` is eye, right, up, forward; VTK's pixel centres and ours agree.
        """
        eye, _, up, forward = np.array(job["frame"])
        size = int(job["size"])
        self.window.SetSize(size, size)
        camera = self.renderer.GetActiveCamera()
        camera.SetPosition(*eye)
        camera.SetFocalPoint(*(eye + forward))
        camera.SetViewUp(*up)
        camera.SetViewAngle(2 * float(np.degrees(job["extent"])))
        camera.SetClippingRange(float(job["near_mm"]), float(job["far_mm"]))

    def draw(self) -> None:
        """Draw one frame, as after a movement, and wait for it."""
        # VTK re-sorts and re-casts only for a camera that has changed.
        self.renderer.GetActiveCamera().Modified()
        self.window.Render()
        self.window.WaitForCompletion()

    def picture(self) -> NDArray[np.float32]:
        """Read the last frame: RGB ``(h, w, 3)``, row 0 at the top, values as blended.

        Eight bits a channel is all that the window keeps.
        """
        width, height = self.window.GetSize()
        data = vtkUnsignedCharArray()
        self.window.GetPixelData(0, 0, width - 1, height - 1, 0, data, 0)
        pixels = vtk_arrays.vtk_to_numpy(data).reshape(height, width, 3)[::-1]
        return np.ascontiguousarray(pixels, dtype=np.float32) / np.float32(255)

    def answer(self, folder: Path, job: Job) -> Answer:
        """Time frames, three unless the job says how many at least; save the last."""
        least = int(job.get("least", 3))
        timing, _ = measure(self.draw, budget_s=float(job["budget_s"]), least=least)
        path = folder / "picture.npy"
        np.save(path, self.picture(), allow_pickle=False)
        return Answer(timing=timing, picture=str(path))
