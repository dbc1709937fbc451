"""The overview in the window: drawn by VTK off screen, shown as a picture.

One OpenGL widget would make Qt put the whole window together by OpenGL. Without a
graphics card that cost 34 ms of processor time for each picture of the endoscope
(measured, 1280 x 860 window); a window of plain pictures needs no OpenGL at all.

A picture by software takes up to 0.4 s where the head is new or was turned. VTK lets go
of the interpreter while it renders, so one thread of the overview's own does all that
touches the scene, in the order asked for: an OpenGL context belongs to one thread.
"""

import threading
import time
import traceback
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QCoreApplication, QPointF, QRectF, Qt, Signal, Slot
from PySide6.QtGui import (
    QColor,
    QImage,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QWidget

from app.window.panels.qt_image import image_of
from app.window.panels.refresher import Refresher
from app.window.panels.side_marks import paint_letters
from app.window.scaling import Scaled, hold
from app.window.style import OVER, font_of
from app.window.texts import tr
from paravol.slices.cutaway import Cutaway
from paravol.slices.side_letters import SideLetter, side_letters
from scenarios import Endoscope, FrameState

if TYPE_CHECKING:
    import pyvista as pv

    from app.vtk.head_model import HeadModel
    from app.vtk.overview_scene import OverviewScene

BACKGROUND = "#0d1117"

TURN_DEG = 0.4
"""For each pixel that the mouse is dragged."""

ZOOM = 1.1
"""For each notch of the wheel."""

_NOTCH = 120.0


@dataclass(frozen=True, slots=True)
class _Picture:
    """A drawn picture, its letters, and how long the drawing took."""

    image: QImage
    letters: tuple[SideLetter, ...]
    took_s: float


class OverviewView(QWidget, Scaled):
    """Show the overview; drag turns it, the wheel zooms."""

    changed = Signal()
    """Its size, its camera or the head: it should be drawn again."""
    drawn = Signal(float)
    """A picture that was asked for is shown; how long its drawing took, s."""
    _pictured = Signal(object)
    """A `_Picture` is ready; emitted by the thread that draws."""
    _cut = Signal(object)
    """A `Cutaway` is ready; emitted by the thread that made it."""
    _renewed = Signal(object)
    """The head's mesh and its `Cutaway`, or None, of what was cut meanwhile."""

    def __init__(self, endoscope: Endoscope, edge_samples: int) -> None:
        """Begin without a scene: it is made for the first picture that is asked for.

        edge_samples: samples a pixel for smooth edges; 0 for none.
        """
        super().__init__()
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self._drawer = ThreadPoolExecutor(1, thread_name_prefix="overview")
        self._waiting: list[Callable[[], object]] | None = [
            lambda: self._make_scene(endoscope, edge_samples)
        ]
        """What is to be done with the first picture; None from then on."""
        self._is_made = False
        self._is_released = False
        self._plotter: pv.Plotter
        self.scene: OverviewScene
        self._image = QImage()
        self._letters: tuple[SideLetter, ...] = ()
        hold(self, setMinimumWidth=120, setMinimumHeight=90)
        self._dragged_from: QPointF | None = None
        self._head: HeadModel | None = None
        self._told = "The head is being made ready"
        self._cutaway: Cutaway | None = None
        self._is_open = False
        self._is_cutting = False
        self._is_edited = False
        self._pictured.connect(self._on_pictured)
        self._cut.connect(self._on_cut)
        self._renewed.connect(self._on_renewed)
        self._refresher = Refresher(self._make_anew, self._renewed.emit)

    def take_scale(self) -> None:
        """Scale VTK's text, whose sizes are in points, at 72 to the inch."""
        scale = self.scale

        def change() -> None:
            window = self._plotter.render_window
            assert window is not None
            window.SetDPI(round(72 * scale))

        self._change(change)

    @property
    def has_head(self) -> bool:
        """Return whether pictures that are asked for now show a head."""
        return self._head is not None

    def tell(self, words: str) -> None:
        """Say why there is no picture."""
        self._told = words
        self.update()

    def show_head(self, head: "HeadModel") -> None:
        """Show a head, whole."""
        self._head = head
        self._change(lambda: self.scene.show_head(head))
        if self._is_edited:
            # perhaps after it was made
            self.refresh()

    def show_fiducials(
        self, fiducials: Mapping[str, NDArray[np.float64]], touched: int
    ) -> None:
        """Mark the divots of the mock head: done, next, still to come."""
        self._change(lambda: self.scene.show_fiducials(fiducials, touched))

    def hide_fiducials(self, fiducials: Mapping[str, NDArray[np.float64]]) -> None:
        """Take the divots away."""
        self._change(lambda: self.scene.hide_fiducials(fiducials))

    def refresh(self) -> None:
        """Show what was cut or put back, within about a second."""
        self._is_edited = True
        if self._head is not None:
            self._refresher.ask()

    def _make_anew(self) -> "tuple[pv.PolyData, Cutaway | None]":
        """Make the head's mesh, and its cutaway where there is one."""
        head = self._head
        assert head is not None
        assert head.renew is not None
        cut_open = None if self._cutaway is None else head.cut_open
        return head.renew(), None if cut_open is None else cut_open()

    @Slot(object)
    def _on_renewed(self, made: "tuple[pv.PolyData, Cutaway | None]") -> None:
        mesh, cutaway = made
        self._change(lambda: self.scene.renew_head(mesh))
        if cutaway is not None:
            before, self._cutaway = self._cutaway, cutaway
            self._show()
            if before is not None:
                # after what was asked of it before
                self._do(before.close)

    def switch(self) -> str:
        """Open the head from the side, or close it; say what happens."""
        if self._head is None or self._head.cut_open is None:
            return tr("There is no head to open yet")
        self._is_open = not self._is_open
        if self._is_open and self._cutaway is None:
            if not self._is_cutting:
                self._is_cutting = True
                cut_open, report = self._head.cut_open, self._cut.emit
                # seconds of work that nothing waits for
                threading.Thread(
                    target=lambda: report(cut_open()), name="cut", daemon=True
                ).start()
            return tr("Opening the head")
        self._show()
        return tr("Head opened") if self._is_open else tr("Head closed")

    @Slot(object)
    def _on_cut(self, cutaway: Cutaway) -> None:
        self._cutaway = cutaway
        self._is_cutting = False
        self._show()
        if self._is_edited:
            # perhaps after it was made
            self.refresh()

    def _show(self) -> None:
        cutaway = self._cutaway if self._is_open else None
        self._change(lambda: self.scene.open_head(cutaway))

    def draw(self, view: FrameState | None = None) -> None:
        """Have the scene drawn, with the tools as in a view; returns at once.

        `drawn` tells the end. view: None leaves the tools where they are.
        """
        scale = self.devicePixelRatioF()
        size = [round(self.width() * scale), round(self.height() * scale)]
        self._begin()
        self._do(lambda: self._draw(view, size))

    def finish(self) -> None:
        """Wait until all that was asked for is drawn and shown."""
        if self._is_released:
            return
        self._begin()
        self._drawer.submit(int).result()
        QCoreApplication.sendPostedEvents(self)

    def _begin(self) -> None:
        """Have the scene made, and what was asked of it done, if not begun yet."""
        if self._waiting is not None:
            waiting, self._waiting = self._waiting, None
            for work in waiting:
                self._do(work)

    def _make_scene(self, endoscope: Endoscope, edge_samples: int) -> None:
        """Load the libraries and make the scene: it takes a second or two."""
        import pyvista as pv

        from app.vtk.overview_scene import OverviewScene

        self._plotter = pv.Plotter(off_screen=True)
        if edge_samples:
            self._plotter.enable_anti_aliasing("msaa", multi_samples=edge_samples)
        else:
            self._plotter.disable_anti_aliasing()
        self.scene = OverviewScene(self._plotter, endoscope, BACKGROUND)
        self._is_made = True

    def _close_scene(self) -> None:
        if self._is_made:
            self._plotter.close()
        if self._cutaway is not None:
            self._cutaway.close()

    def _draw(self, view: FrameState | None, size: list[int]) -> None:
        """Draw and tell the window; in the overview's own thread."""
        if self._is_released:
            return
        begun = time.monotonic()
        if view is not None:
            self.scene.follow(view)
        if list(self._plotter.window_size) != size:
            self._plotter.window_size = size
        image = image_of(self.scene.picture())
        letters = side_letters(*self.scene.picture_axes)
        # nobody may be left to be told
        with suppress(RuntimeError):
            self._pictured.emit(_Picture(image, letters, time.monotonic() - begun))

    @Slot(object)
    def _on_pictured(self, picture: _Picture) -> None:
        self._image, self._letters = picture.image, picture.letters
        self.update()
        self.drawn.emit(picture.took_s)

    def _change(self, work: Callable[[], object]) -> None:
        """Have the scene changed, and ask to be drawn."""
        self._do(work)
        self.changed.emit()

    def _do(self, work: Callable[[], object]) -> None:
        """Have something done by the overview's own thread, after all before it."""
        if self._waiting is not None:
            self._waiting.append(work)
        elif not self._is_released:
            self._drawer.submit(work).add_done_callback(_tell_defect)

    def release(self) -> None:
        """Have the graphics memory freed and the threads end; returns at once."""
        if self._is_released:
            return
        self._is_released = True
        self._refresher.close()
        # in the thread that the OpenGL context belongs to; no page waits for a picture
        self._drawer.submit(self._close_scene)
        self._drawer.shutdown(wait=False)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the newest picture."""
        painter = QPainter(self)
        if self._image.isNull():
            painter.fillRect(self.rect(), QColor(BACKGROUND))
            painter.setPen(OVER.quiet)
            painter.setFont(font_of(10, self.scale))
            centred = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(self.rect(), int(centred), self._told)
        else:
            painter.drawImage(self.rect(), self._image)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            room = QRectF(self.rect())
            paint_letters(painter, room, self._letters, self.scale, is_round=False)
        painter.end()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Ask to be drawn in the new size."""
        self.changed.emit()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin to turn the head."""
        self._dragged_from = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn the head about its middle, the patient's up staying up."""
        if self._dragged_from is None:
            return
        moved = event.position() - self._dragged_from
        self._dragged_from = event.position()
        right_deg, up_deg = -TURN_DEG * moved.x(), TURN_DEG * moved.y()
        self._change(lambda: self.scene.turn(right_deg, up_deg))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go of the head."""
        self._dragged_from = None

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom."""
        factor = ZOOM ** (event.angleDelta().y() / _NOTCH)
        self._change(lambda: self.scene.zoom(factor))


def _tell_defect(done: "Future[object]") -> None:
    """Have a defect reported as any thread's is; nobody asks for the result."""
    error = done.exception()
    if error is not None:
        traceback.print_exception(error)
