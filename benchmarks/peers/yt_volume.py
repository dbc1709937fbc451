"""yt's sampler of volumes: emission and absorption along rays that are given.

A library that yt needs brings a top-level package `tests`, which would hide ours. So yt
may lie in a folder of its own, which the variable PARAVOL_YT names.
"""

import os
import sys
from pathlib import Path

import numpy as np

from benchmarks.peers.job_loop import Job, serve
from benchmarks.peers.peer_process import Answer
from benchmarks.timing import measure

if folder := os.environ.get("PARAVOL_YT"):
    # last: of what is here, too, this process has what we have
    sys.path.append(folder)

try:
    from yt.utilities.lib.image_samplers import VolumeRenderSampler
    from yt.utilities.lib.partitioned_grid import PartitionedGrid
    from yt.visualization.volume_rendering.transfer_functions import (
        MultiVariateTransferFunction,
        TransferFunction,
    )
except ImportError as error:
    raise SystemExit(
        f"no yt here ({str(error).splitlines()[0]}); docs/gallery.md says how to "
        "install it"
    ) from error

SAMPLES_A_CELL = 2
"""As many as steps of half a voxel; yt's default of 10 takes 3.3 times as long."""
METHOD = "KDTree"


class YtPeer:
    """Draw one volume after the other on one thread, without lights."""

    def __init__(self) -> None:
        self._grid: PartitionedGrid | None = None
        self._bounds = 0.0, 0.0
        self._loaded = ""

    def work(self, job: Job, folder: Path) -> Answer:
        """Draw a job's view; see `peer_jobs.VolumeJobs`. Samples go by cells.

        yt blends what it meets later over what it met before. So rays begin at the far
        end and come to the eye, all of one length; opacities are given for that.
        """
        if job["shaded"]:
            return Answer(error="yt has no lights that go by gradients")
        if job["values"] != self._loaded:
            self._load(job)
        eye, right, up, forward = np.array(job["frame"])
        size, reach = int(job["size"]), float(job["far_mm"])
        across = np.tan(job["extent"]) * ((np.arange(size) + 0.5) * 2 / size - 1)
        rays = across[:, None] * right - across[:, None, None] * up + forward
        rays *= reach / np.linalg.norm(rays, axis=-1, keepdims=True)
        table = np.load(job["table"], allow_pickle=False)
        transfer = transfer_of(table, self._bounds, reach)
        nothing = np.zeros(3)

        def draw() -> np.ndarray:
            image = np.zeros((size, size, 4))
            sampler = VolumeRenderSampler(
                eye + rays,
                -rays,
                nothing,
                (0.0, 1.0, 0.0, 1.0),
                image,
                nothing,
                nothing,
                nothing,
                METHOD,
                transfer,
                SAMPLES_A_CELL,
                lens_type="perspective",
            )
            sampler.cast_through_kdtree(self._grid, num_threads=1)
            return np.asarray(sampler.aimage)

        # it has nothing to warm up, and takes long
        timing, image = measure(
            draw, budget_s=float(job["budget_s"]), least=1, warm_up=False
        )
        path = folder / "picture.npy"
        np.save(path, image[..., :3].astype(np.float32), allow_pickle=False)
        return Answer(timing=timing, picture=str(path))

    def _load(self, job: Job) -> None:
        """Give voxel centres as corners of its cells: no value is averaged."""
        values = np.load(job["values"], allow_pickle=False)
        points = np.ascontiguousarray(values.transpose(2, 1, 0), np.float64)
        self._bounds = float(points.min()), float(points.max())
        cells = np.array(points.shape) - 1
        low = np.array(job["origin_mm"], float)
        self._grid = PartitionedGrid(
            0,
            [points],
            np.ones(cells, np.uint8),
            low,
            low + cells * np.array(job["spacing_mm"], float),
            cells.astype(np.int64),
        )
        self._loaded = job["values"]


def transfer_of(
    table: np.ndarray, values: tuple[float, float], unit_mm: float
) -> MultiVariateTransferFunction:
    """Return rows (density, r, g, b, extinction) as emission and absorption.

    values: the least and the greatest that there are. At its bounds and beyond yt has
    nothing, where ours holds the end values; so bounds lie outside of both.
    """
    bounds = min(values[0], table[0, 0]) - 1.0, max(values[1], table[-1, 0]) + 1.0
    densities = np.linspace(*bounds, 8192)
    kappa = unit_mm * np.interp(densities, table[:, 0], table[:, 4])
    found = MultiVariateTransferFunction(grey_opacity=True)
    for channel in range(4):
        one = TransferFunction(bounds, nbins=len(densities))
        one.y = kappa.copy()
        if channel < 3:
            one.y *= np.interp(densities, table[:, 0], table[:, 1 + channel])
        found.add_field_table(one, 0)
        found.link_channels(channel, channel)
    return found


if __name__ == "__main__":
    serve(YtPeer().work)
