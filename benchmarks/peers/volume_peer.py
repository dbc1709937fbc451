"""VTK's best CPU ray caster on the benchmarks' subjects, and how far off it is."""

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.peer_jobs import VolumeJobs
from benchmarks.peers.peer_process import PeerProcess
from benchmarks.plan import Measured
from benchmarks.scenes import SubjectSource
from renderers.scene import Projection, image_error

PEER = "VTK fixed-point"
PEER_REFERENCE_STEP = 1 / 16
"""What the peer's shaded pictures are compared with: itself at this step. Its shading
inside a cavity follows one view direction for the whole picture, so that its distance
from our picture would say nothing about its steps."""


class VolumePeer:
    """Draw subjects with the peer, square pictures of one size, on one thread."""

    def __init__(self, size: int, budget_s: float) -> None:
        self.size = size
        self.budget_s = budget_s
        self._process = PeerProcess("benchmarks.peers.vtk_volume")
        self._jobs: dict[tuple[str, str], VolumeJobs] = {}
        self._finest: dict[tuple[str, str], NDArray[np.float32]] = {}
        self._errors: dict[tuple[str, str, str, float], float] = {}

    def close(self) -> None:
        """End the process."""
        self._process.close()

    def draw(
        self, source: SubjectSource, view: str, quantity: str, step: float
    ) -> Measured:
        """Time pictures at a step of so many voxels; tell their error."""
        if quantity == "shaded" and (source.name, view) not in self._finest:
            self._draw(source, view, quantity, PEER_REFERENCE_STEP, 0.0)
        made = self._draw(source, view, quantity, step, self.budget_s)
        assert made.error is not None
        self._errors[source.name, view, quantity, step] = made.error.rmse
        return made

    def error(
        self, source: SubjectSource, view: str, quantity: str, step: float
    ) -> float:
        """Return the RMSE of a picture, drawn unless it has been."""
        key = source.name, view, quantity, step
        if key not in self._errors:
            self.draw(source, view, quantity, step)
        return self._errors[key]

    def _draw(
        self,
        source: SubjectSource,
        view: str,
        quantity: str,
        step: float,
        budget_s: float,
    ) -> Measured:
        subject = source.subject
        camera = subject.views[view].camera(self.size, Projection.PERSPECTIVE)
        scene = subject.in_mode(quantity)
        key = source.name, quantity
        if key not in self._jobs:
            self._jobs[key] = VolumeJobs(self._process, scene)
        shaded = quantity == "shaded"
        job = self._jobs[key].job(camera, step, shaded=shaded, budget_s=budget_s)
        answer = self._process.ask(job)
        picture = self._process.picture(answer)
        if shaded:
            reference = self._finest.setdefault((source.name, view), picture)
        else:
            reference = source.references.picture(view, quantity, lambda: scene, camera)
        return Measured(answer.timing, image_error(picture, reference), "linear")
