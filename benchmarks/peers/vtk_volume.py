"""The strongest CPU ray caster of VTK, `vtkFixedPointVolumeRayCastMapper`."""

from pathlib import Path
from typing import Any

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


class VtkVolumePeer:
    """Draw one volume after the other in one window, with the mapper that is given."""

    def __init__(self, mapper: Any) -> None:
        self._window = PeerWindow()
        self._mapper = mapper
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
        step_mm = float(job["step_mm"])
        classify(self._property, job, step_mm)
        light(self._window.renderer, self._property, job)
        self._mapper.SetSampleDistance(step_mm)
        # Without it the finished picture is placed at the depth of the volume's
        # centre, and lost when that is behind the eye; with it VTK reads the depth
        # buffer first, which costs a little.
        if isinstance(self._mapper, vtkFixedPointVolumeRayCastMapper):
            behind = bool(job["centre_behind"])
            self._mapper.SetIntermixIntersectingGeometry(behind)
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


def classify(property: vtkVolumeProperty, job: Job, unit_mm: float) -> None:
    """Give a volume's property a job's colours, and its opacities of so many mm."""
    table = np.load(job["table"], allow_pickle=False)
    color, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
    for density, red, green, blue, kappa in table.tolist():
        color.AddRGBPoint(density, red, green, blue)
        opacity.AddPoint(density, float(-np.expm1(-kappa * unit_mm)))
    property.SetColor(color)
    property.SetScalarOpacity(opacity)
    # Where this is the step, nothing is left to correct.
    property.SetScalarOpacityUnitDistance(unit_mm)


def light(renderer: Any, property: vtkVolumeProperty, job: Job) -> None:
    """Put a job's lights in place of what a renderer has."""
    renderer.RemoveAllLights()
    # As our light: what looks away from a light gets none of it.
    renderer.SetTwoSidedLighting(False)
    shaded = bool(job["shaded"])
    property.SetShade(shaded)
    property.SetAmbient(float(job["ambient"]))
    property.SetDiffuse(float(job["diffuse"]))
    property.SetSpecular(0.0)
    for vector, color in job["lights"] if shaded else []:
        source = vtkLight()
        source.SetLightTypeToSceneLight()
        source.PositionalOff()
        source.SetPosition(*vector)
        source.SetFocalPoint(0, 0, 0)
        source.SetDiffuseColor(*color)
        # VTK multiplies ambient by each light's own; ours has no colour.
        source.SetAmbientColor(*[1 / len(job["lights"])] * 3)
        renderer.AddLight(source)


def fixed_point() -> vtkFixedPointVolumeRayCastMapper:
    """Give the mapper of this module, on one thread."""
    mapper = vtkFixedPointVolumeRayCastMapper()
    mapper.SetNumberOfThreads(1)
    return mapper


if __name__ == "__main__":
    serve(VtkVolumePeer(fixed_point()).work)
