"""Draw a scan in a thread: the newest wish wins, and rays grow from splats."""

import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from PySide6.QtCore import QObject, Signal

from app.vtk.volume_surface import SurfaceDrawer
from app.window.background_work import words_for
from app.window.ending import begin_ending
from app.window.texts import later
from paravol.volume.look import VolumeLook
from paravol.volume.scan import Scan
from paravol.volume.volume_view import Drawn, Method, PendingRequest, VolumeView, half
from renderers.art.tracer import RenderStoppedError
from system import UserError


@dataclass(frozen=True, slots=True)
class Order:
    """Ask for a picture. surface: its colour where the surface is wanted, else empty.

    is_moving: the view still turns, and quick is better than fine.
    """

    wish: PendingRequest
    surface: str = ""
    is_moving: bool = False


ROUGH = later("A rough surface is being made")
VOLUME = later("The volume is being made; the first time, its kernels are compiled")


class VolumeThread(QObject):
    """Draw for a page. stage: what is being made, "" for nothing that takes its time.

    Whoever looks asks: what takes long would tell it only afterwards.
    """

    drawn = Signal(object)
    """A `Drawn`."""
    growing = Signal(float)
    """The share of a picture by rays that is done."""
    refining = Signal(str)
    """What is being made while something coarse is shown."""
    failed = Signal(str)
    """Why there is no picture, in a sentence."""

    def __init__(self, scans: Sequence[Scan], threads: int) -> None:
        super().__init__()
        self._volumes = {scan.name: scan.volume for scan in scans}
        self._view = VolumeView(scans, threads)
        self._changed = threading.Condition()
        self._wanted: Order | None = None
        self._is_closed = False
        self._is_drawing = False
        self._is_rough = True
        self.stage = ""
        self._thread = threading.Thread(target=self._run, name="volume", daemon=True)

    @property
    def is_idle(self) -> bool:
        """Return whether nothing is drawn, nor waits to be."""
        with self._changed:
            return self._wanted is None and not self._is_drawing

    def start(self) -> None:
        """Begin to draw."""
        self._thread.start()

    def ask(self, order: Order) -> None:
        """Have a picture drawn; one that is being drawn by rays is given up."""
        with self._changed:
            self._wanted = order
            self._changed.notify()

    def leave(self) -> threading.Thread:
        """End; a picture by rays is given up. See `begin_ending`."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()
        return begin_ending(self, self._ended)

    def _ended(self, patience_s: float) -> bool:
        self._thread.join(patience_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        surfaces = SurfaceDrawer()
        while True:
            with self._changed:
                self._is_drawing = False
                self._changed.wait_for(lambda: self._wanted or self._is_closed)
                order, self._wanted = self._wanted, None
                if self._is_closed or order is None:
                    break
                self._is_drawing = True
            # nobody may be left to be told
            with suppress(RuntimeError):
                self._try(order, surfaces)
            self.stage = ""
        surfaces.close()
        self._view.close()

    def _try(self, order: Order, surfaces: SurfaceDrawer) -> None:
        try:
            self._draw(order, surfaces)
        except RenderStoppedError:
            return
        except Exception as error:
            self.failed.emit(words_for(error))

    def _draw(self, order: Order, surfaces: SurfaceDrawer) -> None:
        if order.surface:
            self.stage = ROUGH
            self._draw_surface(order, surfaces)
            self._is_rough = False
            return
        if self._is_rough:
            self._draw_roughly(order, surfaces)
        self.stage = VOLUME
        self._draw_volume(order)
        self._is_rough = False

    def _draw_roughly(self, order: Order, surfaces: SurfaceDrawer) -> None:
        """Draw a coarse surface before the first volume, which keeps waiting longer."""
        self.stage = ROUGH
        wish = order.wish
        volume, camera = self._volumes[wish.scan], wish.orbit.camera(wish.size)
        begun = time.monotonic()
        # what it has no surface of is not shown before
        with suppress(UserError):
            colour = surface_colour(wish.look)
            pixels = surfaces.draw(volume, wish.look, colour, camera, is_coarse=True)
            self.drawn.emit(Drawn(pixels, time.monotonic() - begun))
            self.refining.emit(later("a coarse surface, until the volume is there"))

    def _draw_volume(self, order: Order) -> None:
        """Draw splats or rays, something quick before what is slow."""
        wish = order.wish
        is_quick = wish.method.splat_mode is not None
        if order.is_moving:
            self.drawn.emit(self._view.draw(half(_quick(wish))))
            return
        if not is_quick:
            # something to look at until the rays are there
            self.drawn.emit(self._view.draw(half(_quick(wish))))
        self.drawn.emit(self._view.draw(wish, self._goes_on))

    def _draw_surface(self, order: Order, surfaces: SurfaceDrawer) -> None:
        """Draw a coarse surface where a fine one keeps waiting, then the fine one."""
        wish = order.wish
        volume, camera = self._volumes[wish.scan], wish.orbit.camera(wish.size)

        def draw(is_coarse: bool) -> None:
            begun = time.monotonic()
            pixels = surfaces.draw(
                volume, wish.look, order.surface, camera, is_coarse=is_coarse
            )
            self.drawn.emit(Drawn(pixels, time.monotonic() - begun))

        is_there = surfaces.has(volume, wish.look)
        if order.is_moving or not is_there:
            draw(True)
        if order.is_moving or self._wanted is not None or self._is_closed:
            return
        if not is_there:
            self.refining.emit(later("a coarse surface; the fine one is being made"))
        draw(False)

    def _goes_on(self, share: float) -> bool:
        self.growing.emit(share)
        return self._wanted is None and not self._is_closed


def surface_colour(look: VolumeLook) -> str:
    """Return a look's colour at its surface: of the first point above it."""
    above = [p for p in look.points if p.density >= look.surface and p.opacity]
    return (above or look.points)[0].colour


def _quick(wish: PendingRequest) -> PendingRequest:
    """Return the wish by splats."""
    if wish.method.splat_mode is not None:
        return wish
    return replace(wish, method=Method.SPLATS)
