"""The page of a scan: seen whole as a volume or a surface, its look beside it."""

import math
import time
from collections.abc import Sequence
from pathlib import Path
from threading import Thread

from PySide6.QtCore import QTimer, Slot
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QPushButton, QVBoxLayout

from app.window.page import TextPage
from app.window.plain_label import PlainLabel
from app.window.scaling import hold, lay
from app.window.texts import later, tr
from app.window.volume.volume_controls import VolumeControls
from app.window.volume.volume_picture import VolumePicture
from app.window.volume.volume_thread import Order, VolumeThread, surface_colour
from paravol.volume.look import load_look, save_look
from paravol.volume.orbit import Orbit
from paravol.volume.scan import Scan
from paravol.volume.volume_view import Drawn, Method, PendingRequest
from system import UserError

LOOKS = later("Looks (*.json)")
KEYS = later(
    "Drag turns · right button shifts · wheel or + - nearer · arrows turn · "
    "Ctrl+O open look · Ctrl+S save look · F11 full screen · Esc back"
)
SETTLED_MS = 150
"""So long after the last resize the picture is drawn anew."""

LOOKED_MS, SILENT_S = 100, 0.4
"""How often it is looked at what is being made, and how long that may take untold."""

MOST_PX = 1024
"""Of the picture's sides: a larger one is shown larger, not finer."""


class VolumePage(TextPage):
    """Show scans of one patient."""

    def __init__(self, title: str, scans: Sequence[Scan], threads: int) -> None:
        """Lay the page out; title: of the patient."""
        super().__init__()
        title = tr(title)
        self.title = f"PARAVOL: {title}"
        self._orbit = Orbit.round(scans[0].volume)
        self.picture = VolumePicture()
        self.picture.start(self._orbit)
        self.controls = VolumeControls(scans)
        self.drawing = VolumeThread(scans, threads)
        self._heading = PlainLabel(title, "heading")
        self._back = QPushButton(tr("Back"))
        self._lay_out()
        self._settling = QTimer(self)
        self._settling.setSingleShot(True)
        self._settling.timeout.connect(self._ask)
        self._busy_since_s, self._grown = math.inf, 0.0
        self._looking = QTimer(self)
        self._looking.timeout.connect(self._look)
        self._looking.start(LOOKED_MS)
        self.show_stage("")
        self.picture.resized.connect(lambda: self._settling.start(SETTLED_MS))
        self.picture.turned.connect(self._on_turned)
        self.controls.changed.connect(self._ask)
        self.controls.load_wanted.connect(self._on_load)
        self.controls.save_wanted.connect(self._on_save)
        self._back.clicked.connect(self.left)
        self.drawing.drawn.connect(self._on_drawn)
        self.drawing.growing.connect(self._on_growing)
        for told in (self.drawing.refining, self.drawing.failed):
            told.connect(self._say)
        for keys, does in (
            ("Ctrl+O", self._on_load),
            ("Ctrl+S", self._on_save),
            ("F11", self.full_screen_wanted.emit),
            ("Esc", self.left.emit),
        ):
            QShortcut(QKeySequence(keys), self).activated.connect(does)
        self.drawing.start()

    def _lay_out(self) -> None:
        rows = lay(QVBoxLayout(self), 12, 12, 12, 6, gap=8)
        hold(self.share, setFixedWidth=160)
        head = QHBoxLayout()
        head.addWidget(self._heading, 1)
        head.addWidget(self.stage)
        head.addWidget(self.share)
        head.addWidget(self._back)
        middle = QHBoxLayout()
        middle.addWidget(self.picture, 5)
        middle.addWidget(self.controls, 3)
        keys = PlainLabel(tr(KEYS), wraps=True)
        rows.addLayout(head)
        rows.addWidget(self.problem)
        rows.addLayout(middle, 1)
        rows.addWidget(keys)
        self.setFocusProxy(self.picture)

    def release(self) -> list[Thread]:
        """End the thread."""
        self._settling.stop()
        self._looking.stop()
        return [self.drawing.leave()]

    def open_look(self, file: Path) -> None:
        """Take over a look of a file; what is wrong with it is said."""
        try:
            self.controls.show_look(load_look(file))
        except UserError as error:
            self.picture.say(tr(str(error)))

    def keep_look(self, file: Path) -> None:
        """Write the look into a file; what goes wrong is said."""
        if file.suffix.lower() != ".json":
            file = file.with_name(file.name + ".json")
        try:
            save_look(self.controls.look, file)
        except OSError as error:
            self.picture.say(
                tr(
                    "{file} cannot be written: {error}.",
                    file=file,
                    error=error.strerror,
                )
            )
        else:
            self.picture.say(tr("The look is saved in {file}", file=file))

    def _on_load(self) -> None:
        name, _ = QFileDialog.getOpenFileName(self, tr("Open a look"), "", tr(LOOKS))
        if name:
            self.open_look(Path(name))

    def _on_save(self) -> None:
        name, _ = QFileDialog.getSaveFileName(self, tr("Save the look"), "", tr(LOOKS))
        if name:
            self.keep_look(Path(name))

    @Slot(object, bool)
    def _on_turned(self, orbit: Orbit, is_moving: bool) -> None:
        self._orbit = orbit
        self._ask(is_moving=is_moving)

    def _ask(self, *, is_moving: bool = False) -> None:
        """Have drawn what is chosen, as it is seen now."""
        scale = self.picture.devicePixelRatioF()
        wide, high = self.picture.width() * scale, self.picture.height() * scale
        shrunk = min(1.0, MOST_PX / max(wide, high))
        size = max(round(wide * shrunk), 8), max(round(high * shrunk), 8)
        controls, method = self.controls, self.controls.chosen_method
        wish = PendingRequest(
            controls.scan.name,
            controls.look,
            Method.SPLATS if method is None else method,
            self._orbit,
            size,
        )
        surface = surface_colour(controls.look) if method is None else ""
        self.drawing.ask(Order(wish, surface, is_moving))

    @Slot(object)
    def _on_drawn(self, drawn: Drawn) -> None:
        self.picture.show_picture(drawn.pixels)
        took_s = drawn.seconds
        told = f"{1e3 * took_s:.0f} ms" if took_s < 1.0 else f"{took_s:.1f} s"
        if drawn.splats is not None:
            told += tr(" · {splats:,} splats", splats=drawn.splats)
        self.picture.say(told)

    @Slot(str)
    def _say(self, text: str) -> None:
        self.picture.say(tr(text))

    @Slot(float)
    def _on_growing(self, share: float) -> None:
        self._grown = share
        self.picture.say(tr("rays: {share:.0%}", share=share))

    @Slot()
    def _look(self) -> None:
        """Say what is being made, and for how long, where it takes its time."""
        now_s, stage = time.monotonic(), self.drawing.stage
        if not stage:
            self._busy_since_s, self._grown = now_s, 0.0
        busy_s = now_s - self._busy_since_s
        told = f"{tr(stage)} · {busy_s:.0f} s" if busy_s >= SILENT_S else ""
        if told != self.stage.text():
            self.show_stage(told, self._grown)
