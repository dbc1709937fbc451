"""One diffuse room and the scope's light in it, in words a peer understands."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchmarks.peers.peer_process import PeerProcess
from renderers.scene import Camera, Projection, Volume
from renderers.shading import ScopeLight
from renderers.shading.kernels.elementary import NEAREST_MM2
from renderers.shading.path_tracer import SOURCES
from system import UserError

MITSUBA = "benchmarks.peers.mitsuba_light"
LLVM_HINT = (
    "Dr.Jit needs LLVM 16 or newer, which DRJIT_LIBLLVM_PATH may name; docs/light.md"
)


def mitsuba_process() -> PeerProcess:
    """Give the process that runs Mitsuba, not started yet."""
    return PeerProcess(MITSUBA, LLVM_HINT)


class LightJobs:
    """Write a field once; make a job for each picture of its zero set.

    distance: mm, negative in air. albedo: ``(3,)`` of all walls, red, green, blue.
    """

    def __init__(self, peer: PeerProcess, distance: Volume, albedo: ArrayLike) -> None:
        if not np.array_equal(distance.direction, np.eye(3)):
            raise UserError("the peer is given volumes along the world's axes only")
        self._peer = peer
        self._field = {
            "values": peer.store(distance.values),
            "spacing_mm": distance.spacing_mm.tolist(),
            "origin_mm": distance.origin_mm.tolist(),
            "albedo": np.asarray(albedo, float).tolist(),
        }

    def job(
        self,
        camera: Camera,
        light: ScopeLight,
        *,
        paths: int,
        passes: int,
        bounces: int,
        bounced_only: bool = True,
        refined: int = 1,
        lifted_mm: float | None = None,
        seed: int = 0,
    ) -> dict[str, Any]:
        """Ask for the irradiance of what a square pinhole sees.

        paths: of a pixel in each of the independent passes. bounces: walls on the way
        to the one that is seen. bounced_only: without what comes straight from the
        scope. refined: mesh points along the field's spacing. lifted_mm: how far above
        its wall, along the normal it is shaded by, a path goes on, as ours do; None for
        Mitsuba's own way. UserError for a lens.
        """
        pinhole = camera.projection is Projection.PERSPECTIVE
        if (
            not pinhole
            or camera.width != camera.height
            or not camera.distortion.is_none
        ):
            raise UserError("Mitsuba is compared with in square pinhole pictures only")
        return self._field | {
            "frame": camera.frame.tolist(),
            "extent": camera.extent,
            "size": camera.width,
            "sources": light.sources(camera, SOURCES).tolist(),
            "spread": light.spread,
            "power": light.power,
            "nearest_mm2": NEAREST_MM2,
            "lifted_mm": lifted_mm,
            "paths": paths,
            "passes": passes,
            "bounces": bounces,
            "bounced_only": bounced_only,
            "refined": refined,
            "seed": seed,
        }

    def passes(self, job: dict[str, Any]) -> tuple[NDArray[np.float32], float]:
        """Return a job's passes ``(n, h, w, 3)`` and the CPU seconds they took.

        Raises UnavailableError where there is no Mitsuba.
        """
        answer = self._peer.ask(job)
        return self._peer.picture(answer), answer.timing.cpu_s
