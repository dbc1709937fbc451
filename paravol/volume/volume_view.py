"""Draw a scan as splats or by rays, with a look that changes while one watches.

Splats are chosen once for a look and a threshold and are quick from every side; rays
march through the volume itself, and are slower and exact. Both show the same scene.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from paravol.volume.look import VolumeLook
from paravol.volume.orbit import Orbit
from paravol.volume.scan import Scan
from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer, SplatMode
from renderers.scene import Scene
from system import UserError

GROUND = (0.004, 0.006, 0.009)
"""Linear colour behind the head: that of the window."""


class Method(Enum):
    """Name a way to draw a scan, the fastest first."""

    POINTS = "points"
    SPLATS = "splats"
    RAYS = "rays"
    FINE_RAYS = "fine rays"

    @property
    def splat_mode(self) -> SplatMode | None:
        """Return how splats are drawn, None for rays."""
        return _SPLATS.get(self)


_SPLATS = {Method.POINTS: SplatMode.POINTS, Method.SPLATS: SplatMode.GAUSSIAN}
_QUALITY = {Method.RAYS: "preview", Method.FINE_RAYS: "final"}


@dataclass(frozen=True, slots=True)
class PendingRequest:
    """Which picture is wanted; size: ``(width, height)`` pixels."""

    scan: str
    look: VolumeLook
    method: Method
    orbit: Orbit
    size: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Drawn:
    """A picture ``(h, w, 3)`` uint8 sRGB, and what it took.

    splats: in the set; None for rays.
    """

    pixels: NDArray[np.uint8]
    seconds: float
    splats: int | None = None


class VolumeView:
    """Draw wishes one after the other; what two have in common is kept."""

    def __init__(self, scans: Sequence[Scan], threads: int) -> None:
        """Take scans of one patient."""
        self._scans = {scan.name: scan for scan in scans}
        self._threads = threads
        self._shown: tuple[str, VolumeLook] | None = None
        self._splatter: FuzzySetRenderer | None = None
        self._tracers: dict[Method, ActiveRayTracer] = {}

    def draw(
        self,
        wish: PendingRequest,
        progress: Callable[[float], bool] = lambda share: True,
    ) -> Drawn:
        """Draw a wish.

        progress: called with the share of the rays that is done; when it returns False
        the picture is given up with `RenderStoppedError`.
        Raises UserError for a look that cannot be drawn, or a scan there is none of.
        """
        begun = time.monotonic()
        scene = self._scene(wish)
        camera = wish.orbit.camera(wish.size)
        mode = wish.method.splat_mode
        splats = None
        if mode is None:
            if wish.method not in self._tracers:
                self._tracers[wish.method] = ActiveRayTracer(
                    scene, _QUALITY[wish.method], threads=self._threads
                )
            image = self._tracers[wish.method].render(camera, progress)
        else:
            splatter = self._splatter
            if splatter is None:
                splatter = FuzzySetRenderer(
                    scene, threshold=wish.look.threshold, threads=self._threads
                )
                self._splatter = splatter
            if splatter.threshold != wish.look.threshold:
                splatter.threshold = wish.look.threshold
            splatter.mode = mode
            image = splatter.render(camera)
            splats = len(splatter.fuzzy_set)
        return Drawn(image.to_srgb8(GROUND), time.monotonic() - begun, splats)

    def close(self) -> None:
        """Give back what was kept to draw with."""
        if self._splatter is not None:
            self._splatter.close()
        self._splatter = None
        self._tracers.clear()

    def _scene(self, wish: PendingRequest) -> Scene:
        """Return the scene of a wish; what is kept for another scene is given back."""
        scan = self._scans.get(wish.scan)
        if scan is None:
            raise UserError(
                f"there is no scan {wish.scan!r}; there is {', '.join(self._scans)}"
            )
        look = wish.look
        # neither what a look is called nor its surface matters to a volume, and a
        # threshold may be set anew
        shown = scan.name, scene_part(look)
        if shown != self._shown:
            self.close()
            self._shown = shown
        return Scene(scan.volume, look.transfer(), material=look.material())


def scene_part(look: VolumeLook) -> VolumeLook:
    """Return the look without what its scene does not depend on."""
    return VolumeLook(
        "",
        look.points,
        0.0,
        ambient=look.ambient,
        diffuse=look.diffuse,
        specular=look.specular,
    )


def half(wish: PendingRequest) -> PendingRequest:
    """Return the wish for a picture of half the width and height."""
    width, height = wish.size
    return replace(wish, size=(max(width // 2, 1), max(height // 2, 1)))
