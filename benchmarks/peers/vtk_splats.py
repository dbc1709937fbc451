"""Order-correct Gaussian splats of VTK: depth-sorted points, blended as drawn."""

from pathlib import Path

import numpy as np
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersHybrid import vtkDepthSortPolyData
from vtkmodules.vtkRenderingCore import vtkActor, vtkPointGaussianMapper

from benchmarks.peers.job_loop import Job, serve
from benchmarks.peers.peer_process import Answer
from benchmarks.peers.vtk_window import PeerWindow, vtk_arrays


class SplatPeer:
    """Draw one set of splats after the other in one window."""

    def __init__(self) -> None:
        self._window = PeerWindow()
        self._window.renderer.SetUseDepthPeeling(False)
        self._sort = vtkDepthSortPolyData()
        self._sort.SetDirectionToBackToFront()
        self._sort.SetDepthSortModeToFirstPoint()
        self._sort.SetCamera(self._window.renderer.GetActiveCamera())
        self._mapper = vtkPointGaussianMapper()
        self._mapper.SetInputConnection(self._sort.GetOutputPort())
        self._mapper.EmissiveOff()
        self._mapper.SetColorModeToDirectScalars()
        self._mapper.SetScalarModeToUsePointFieldData()
        self._mapper.SelectColorArray("rgba")
        actor = vtkActor()
        actor.SetMapper(self._mapper)
        actor.GetProperty().LightingOff()
        actor.ForceTranslucentOn()
        self._window.renderer.AddActor(actor)
        self._loaded = ""

    def work(self, job: Job, folder: Path) -> Answer:
        """Draw a job's view; see `peer_jobs.splat_job`."""
        if job["points"] != self._loaded:
            self._load(job)
        self._mapper.SetScaleFactor(float(job["sigma_mm"]))
        self._window.look(job)
        return self._window.answer(folder, job)

    def _load(self, job: Job) -> None:
        positions = np.load(job["points"], allow_pickle=False)
        rgba = np.load(job["rgba"], allow_pickle=False)
        n = len(positions)
        points = vtkPoints()
        points.SetData(vtk_arrays.numpy_to_vtk(positions, deep=True))
        cells = vtkCellArray()
        cells.SetData(
            vtk_arrays.numpy_to_vtkIdTypeArray(
                np.arange(n + 1, dtype=np.int64), deep=True
            ),
            vtk_arrays.numpy_to_vtkIdTypeArray(np.arange(n, dtype=np.int64), deep=True),
        )
        colors = vtk_arrays.numpy_to_vtk(rgba, deep=True)
        colors.SetName("rgba")
        data = vtkPolyData()
        data.SetPoints(points)
        data.SetVerts(cells)
        data.GetPointData().AddArray(colors)
        self._sort.SetInputData(data)
        self._loaded = job["points"]


if __name__ == "__main__":
    serve(SplatPeer().work)
