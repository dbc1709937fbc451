"""VTK's best CPU ray caster on the benchmarks' subjects, and how far off it is."""

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.peer_jobs import VolumeJobs
from benchmarks.peers.peer_process import PeerProcess
from benchmarks.plan import Measured
from benchmarks.references import REFERENCE_NAME
from benchmarks.scenes import SubjectSource
from benchmarks.timing import Timing
from renderers.scene import Projection, image_error

PEER = "VTK fixed-point"
PEER_REFERENCE_STEP = 1 / 16
PEER_REFERENCE_NAME = f"{PEER}, step {PEER_REFERENCE_STEP:g}"
"""What the peer's shaded pictures are compared with: itself at this step. Its shading
is not quite ours (.005 to .014 off in a nose, lit from one side of a wall only), so
that its distance from our picture says little about its steps. Either's distance from
the other's finest picture is told beside the row's own error: a distance, not an
error, where that picture is no limit. Fixed point rounds the opacities of short
steps, and faint tissue leaves ours again below half a voxel (measured: RMSE .0164,
.0103 and .0148 at steps 1, 1/2 and 1/4)."""


class VolumePeer:
    """Draw subjects with the peer, square pictures of one size, on one thread."""

    def __init__(self, size: int, budget_s: float) -> None:
        self.size = size
        self.budget_s = budget_s
        self._process = PeerProcess("benchmarks.peers.vtk_volume")
        self._jobs: dict[tuple[str, str], VolumeJobs] = {}
        self._finest: dict[tuple[str, str, str], NDArray[np.float32]] = {}
        self._errors: dict[tuple[str, str, str, float], float] = {}

    def close(self) -> None:
        """End the process."""
        self._process.close()

    def draw(
        self, source: SubjectSource, view: str, quantity: str, step: float
    ) -> Measured:
        """Time pictures at a step of so many voxels; tell both their errors."""
        timing, picture = self._ask(source, view, quantity, step, self.budget_s)
        subject = source.subject
        camera = subject.views[view].camera(self.size, Projection.PERSPECTIVE)
        ours = source.references.picture(
            view, quantity, lambda: subject.in_mode(quantity), camera
        )
        from_ours = image_error(picture, ours)
        from_own = image_error(picture, self.finest(source, view, quantity))
        error, other, name = from_ours, from_own, PEER_REFERENCE_NAME
        if quantity == "shaded":
            error, other, name = from_own, from_ours, REFERENCE_NAME
        self._errors[source.name, view, quantity, step] = error.rmse
        further = {f"against {name}": other.rmse}
        return Measured(timing, error, "linear", further_rmse=further)

    def finest(
        self, source: SubjectSource, view: str, quantity: str
    ) -> NDArray[np.float32]:
        """Return the peer's picture at its finest step, drawn once."""
        key = source.name, view, quantity
        if key not in self._finest:
            _, self._finest[key] = self._ask(
                source, view, quantity, PEER_REFERENCE_STEP, 0.0
            )
        return self._finest[key]

    def error(
        self, source: SubjectSource, view: str, quantity: str, step: float
    ) -> float:
        """Return the RMSE of a picture, drawn unless it has been."""
        key = source.name, view, quantity, step
        if key not in self._errors:
            self.draw(source, view, quantity, step)
        return self._errors[key]

    def _ask(
        self,
        source: SubjectSource,
        view: str,
        quantity: str,
        step: float,
        budget_s: float,
    ) -> tuple[Timing, NDArray[np.float32]]:
        subject = source.subject
        camera = subject.views[view].camera(self.size, Projection.PERSPECTIVE)
        scene = subject.in_mode(quantity)
        key = source.name, quantity
        if key not in self._jobs:
            self._jobs[key] = VolumeJobs(self._process, scene)
        shaded = quantity == "shaded"
        job = self._jobs[key].job(camera, step, shaded=shaded, budget_s=budget_s)
        answer = self._process.ask(job)
        return answer.timing, self._process.picture(answer)
