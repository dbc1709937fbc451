"""The strongest CPU ray caster of VTK, `vtkFixedPointVolumeRayCastMapper`."""

from pathlib import Path

import numpy as np
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import (
    vtkColorTransferFunction,
    vtkLight,
    vtkVolume,
    vtkVolumeProperty,
)
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper

from benchmarks.peers.job_loop import Job, serve
from benchmarks.peers.peer_process import Answer
from benchmarks.peers.vtk_window import PeerWindow, vtk_arrays


class FixedPointPeer:
    """Draw one volume after the other in one window."""

    def __init__(self) -> None:
        self._window = PeerWindow()
        self._mapper = vtkFixedPointVolumeRayCastMapper()
        self._mapper.SetNumberOfThreads(1)
        self._mapper.SetAutoAdjustSampleDistances(False)
        self._mapper.SetLockSampleDistanceToInputSpacing(False)
        self._mapper.SetImageSampleDistance(1.0)
        self._mapper.SetBlendModeToComposite()
        self._property = vtkVolumeProperty()
        self._property.SetInterpolationTypeToLinear()
        volume = vtkVolume()
        volume.SetMapper(self._mapper)
        volume.SetProperty(self._property)
        self._window.renderer.AddVolume(volume)
        self._loaded = ""

    def work(self, job: Job, folder: Path) -> Answer:
        """Draw a job's view; see `peer_jobs.volume_job`."""
        self._load(job)
        self._classify(job)
        self._light(job)
        self._mapper.SetSampleDistance(float(job["step_mm"]))
        # Without it the finished picture is placed at the depth of the volume's
        # centre, and lost when that is behind the eye; with it VTK reads the depth
        # buffer first, which costs a little.
        self._mapper.SetIntermixIntersectingGeometry(bool(job["centre_behind"]))
        self._window.look(job)
        return self._window.answer(folder, job)

    def _load(self, job: Job) -> None:
        if job["values"] == self._loaded:
            return
        values = np.load(job["values"], allow_pickle=False)
        nz, ny, nx = values.shape
        image = vtkImageData()
        image.SetDimensions(nx, ny, nz)
        image.SetSpacing(*job["spacing_mm"])
        image.SetOrigin(*job["origin_mm"])
        image.GetPointData().SetScalars(
            vtk_arrays.numpy_to_vtk(values.ravel(), deep=True)
        )
        self._mapper.SetInputData(image)
        self._loaded = job["values"]

    def _classify(self, job: Job) -> None:
        table = np.load(job["table"], allow_pickle=False)
        color, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
        step_mm = float(job["step_mm"])
        for density, red, green, blue, kappa in table.tolist():
            color.AddRGBPoint(density, red, green, blue)
            opacity.AddPoint(density, float(-np.expm1(-kappa * step_mm)))
        self._property.SetColor(color)
        self._property.SetScalarOpacity(opacity)
        # Opacities are given for exactly one step: nothing is left to correct.
        self._property.SetScalarOpacityUnitDistance(step_mm)

    def _light(self, job: Job) -> None:
        renderer = self._window.renderer
        renderer.RemoveAllLights()
        shaded = bool(job["shaded"])
        self._property.SetShade(shaded)
        self._property.SetAmbient(float(job["ambient"]))
        self._property.SetDiffuse(float(job["diffuse"]))
        self._property.SetSpecular(0.0)
        for vector, color in job["lights"] if shaded else []:
            light = vtkLight()
            light.SetLightTypeToSceneLight()
            light.PositionalOff()
            light.SetPosition(*vector)
            light.SetFocalPoint(0, 0, 0)
            light.SetDiffuseColor(*color)
            # VTK multiplies ambient by each light's own; ours has no colour.
            light.SetAmbientColor(*[1 / len(job["lights"])] * 3)
            renderer.AddLight(light)


if __name__ == "__main__":
    serve(FixedPointPeer().work)
