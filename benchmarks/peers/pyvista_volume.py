"""What `add_volume` of pyvista draws by default, given our transfer function."""

from pathlib import Path
from typing import Any

import numpy as np
import pyvista

from benchmarks.peers.job_loop import Job, serve
from benchmarks.peers.peer_process import Answer
from benchmarks.peers.vtk_volume import classify, light
from benchmarks.timing import measure

OPACITY_MM = 1.0
"""Opacities are given for this length; the step is pyvista's own."""


class PyvistaPeer:
    """Draw one volume after the other, each with a plotter of its own."""

    def __init__(self) -> None:
        self._plotter: Any = None
        self._property: Any = None
        self._loaded: tuple[str, int] | None = None

    def work(self, job: Job, folder: Path) -> Answer:
        """Draw a job's view; see `peer_jobs.VolumeJobs`. Its step is not obeyed."""
        key = job["values"], job["size"]
        if key != self._loaded:
            self._load(job)
            self._loaded = key
        classify(self._property, job, OPACITY_MM)
        light(self._plotter.renderer, self._property, job)
        eye, _, up, forward = np.array(job["frame"])
        camera = self._plotter.camera
        camera.position, camera.focal_point = tuple(eye), tuple(eye + forward)
        camera.up = tuple(up)
        camera.view_angle = 2 * float(np.degrees(job["extent"]))
        camera.clipping_range = job["near_mm"], job["far_mm"]
        timing, _ = measure(self._draw, budget_s=float(job["budget_s"]))
        pixels = self._plotter.screenshot(return_img=True)
        path = folder / "picture.npy"
        picture = np.ascontiguousarray(pixels[..., :3], np.float32) / np.float32(255)
        np.save(path, picture, allow_pickle=False)
        return Answer(timing=timing, picture=str(path))

    def _draw(self) -> None:
        self._plotter.camera.Modified()
        self._plotter.render()
        self._plotter.render_window.WaitForCompletion()

    def _load(self, job: Job) -> None:
        if self._plotter is not None:
            self._plotter.close()
        values = np.load(job["values"], allow_pickle=False)
        grid = pyvista.ImageData(
            dimensions=values.shape[::-1],
            spacing=job["spacing_mm"],
            origin=job["origin_mm"],
        )
        grid.point_data["density"] = values.ravel()
        plotter: Any = pyvista.Plotter(off_screen=True, window_size=[job["size"]] * 2)
        plotter.set_background("black")
        actor = plotter.add_volume(grid, scalars="density", show_scalar_bar=False)
        plotter.show(auto_close=False)
        self._plotter, self._property = plotter, actor.prop


if __name__ == "__main__":
    serve(PyvistaPeer().work)
