"""The trainee's window: the endoscope's picture large, the overview at its side."""

import os
import time
from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Slot
from PySide6.QtGui import QCloseEvent, QKeyEvent
from PySide6.QtWidgets import (
    QApplication,
    QHBoxLayout,
    QLabel,
    QMainWindow,
    QVBoxLayout,
    QWidget,
)

from app.overview_scene import HeadModel
from app.slice_views import SliceViews
from app.window_flight import Instant, WindowFlight
from app.window_gauges import Gauges
from app.window_keys import HandEvents, KeyHelp
from app.window_moments import MomentView
from app.window_overview import OverviewView
from app.window_picture import PictureView
from app.window_readings import Readings
from app.window_slices import SlicesView
from app.window_style import STYLE_SHEET
from renderers.scene import Mesh
from scenarios import Score

OVERVIEW_MS = 100
"""Shortest time between two pictures of the overview."""

OVERVIEW_SHARE = 0.15
"""Largest part of the window's time for the overview, where OpenGL is software."""

ROLL_STEP_DEG = 5.0
NOTICE_S = 4.0


class TraineeWindow(QMainWindow):
    """Show a flight. Lives in the thread that made it, as all of Qt's widgets do."""

    def __init__(
        self,
        flight: WindowFlight,
        instrument: Mesh | None,
        *,
        edge_samples: int,
        seconds: float | None = None,
        screenshot: Path | None = None,
    ) -> None:
        """Lay out the window and listen to the flight.

        instrument: the tool beside the scope, for the overview.
        edge_samples: samples a pixel for smooth edges in the overview.
        seconds: close by itself that long after the first picture.
        screenshot: PNG file for a picture of the window when it closes.
        """
        super().__init__()
        self._order = order = flight.order
        self._flight = flight
        self._instant: Instant | None = None
        self._registration_mm: float | None = None
        self._notice_until_s = 0.0
        self._is_away = False
        self._seconds = seconds
        self._screenshot = screenshot
        self.setWindowTitle(f"PARAVOL: {order.scenario.title}")
        self.setStyleSheet(STYLE_SHEET)
        self.picture = PictureView()
        self._gauges = Gauges()
        self._overview = OverviewView(
            order.scenario.scope.endoscope(), instrument, edge_samples
        )
        self._overview.changed.connect(self._on_overview_changed)
        self._slices = SlicesView()
        self._moments = MomentView()
        self._lay_out()
        if order.input.controls is not None:
            self._hand = HandEvents(order.input.controls, self, self.picture)
        self._overview_due_s = 0.0
        self._is_overview_stale = True
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._refresh)
        self._timer.start(OVERVIEW_MS)
        flight.staged.connect(self._on_stage)
        flight.head_ready.connect(self._on_head)
        flight.slices_ready.connect(self._on_slices)
        flight.touching.connect(self._on_touching)
        flight.registered.connect(self._on_registered)
        flight.arrived.connect(self._on_frame)
        flight.moment_kept.connect(self._on_moment)
        flight.view_kept.connect(self._notify)
        flight.pictured.connect(self._moments.show_moment)
        flight.away.connect(self._on_away)
        flight.back.connect(self._on_back)
        flight.landed.connect(self._on_landed)
        flight.finished.connect(self._on_finished)
        self._on_stage("Starting", 0.0)

    def _lay_out(self) -> None:
        order = self._order
        scope = order.scenario.scope
        side = QWidget()
        side.setObjectName("side")
        column = QVBoxLayout(side)
        column.setContentsMargins(18, 14, 18, 12)
        title = QLabel(self._order.scenario.title)
        title.setObjectName("title")
        title.setWordWrap(True)
        about = QLabel(
            f"{scope.angle_deg:g}° scope, {scope.diameter_mm:g} mm · {order.input.name}"
        )
        about.setWordWrap(True)
        keys = KeyHelp(order.input.keys)
        column.addWidget(title)
        column.addWidget(about)
        column.addWidget(self._overview, 1)
        column.addWidget(self._slices)
        column.addWidget(self._moments)
        column.addWidget(keys)
        middle = QWidget()
        row = QHBoxLayout(middle)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addWidget(self.picture, 5)
        row.addWidget(side, 3)
        whole = QWidget()
        rows = QVBoxLayout(whole)
        rows.setContentsMargins(0, 0, 0, 0)
        rows.setSpacing(0)
        rows.addWidget(middle, 1)
        rows.addWidget(self._gauges)
        self.setCentralWidget(whole)
        self.resize(1280, 860)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Obey a key."""
        match event.key():
            case Qt.Key.Key_Q | Qt.Key.Key_Escape:
                self.close()
            case Qt.Key.Key_F:
                if self.isFullScreen():
                    self.showNormal()
                else:
                    self.showFullScreen()
            case Qt.Key.Key_Left | Qt.Key.Key_Down:
                self._flight.roll.turn_deg -= ROLL_STEP_DEG
            case Qt.Key.Key_Right | Qt.Key.Key_Up:
                self._flight.roll.turn_deg += ROLL_STEP_DEG
            case Qt.Key.Key_M:
                self._notify(self._slices.switch(), "Slices at the tip")
            case Qt.Key.Key_C:
                self._notify(self._overview.switch(), "The side wall of the nose")
            case Qt.Key.Key_Space:
                self._keep_moment()
            case Qt.Key.Key_V if self._instant is not None:
                self._flight.keep_view()
            case _:
                super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Take the screenshot and end the program's event loop."""
        self._timer.stop()
        screenshot, self._screenshot = self._screenshot, None
        if screenshot is not None:
            self._save(screenshot)
        super().closeEvent(event)
        QApplication.quit()

    def release(self) -> None:
        """Free the overview's graphics memory."""
        self._overview.release()

    def _save(self, path: Path) -> None:
        partial = path.with_name(f".{path.stem}.{os.getpid()}.partial.png")
        if not self.grab().save(str(partial)):
            raise ValueError(f"The screenshot {path} cannot be written.")
        os.replace(partial, path)

    def _keep_moment(self) -> None:
        if self._order.record is None:
            self._notify(
                "Moments are kept in a recording",
                "Start with --record NAME.paravol to keep them for snapshots.",
            )
        elif self._instant is not None:
            self._flight.keep_moment()

    @Slot(str, str)
    def _notify(self, message: str, detail: str) -> None:
        self.picture.say(message, detail)
        self._notice_until_s = time.monotonic() + NOTICE_S

    @Slot()
    def _on_overview_changed(self) -> None:
        self._is_overview_stale = True

    @Slot(str, float)
    def _on_stage(self, stage: str, share: float) -> None:
        self.picture.say(stage, "This is quick once it was done before.", share)

    @Slot(object)
    def _on_head(self, head: HeadModel) -> None:
        self._overview.show_head(head)

    @Slot(object)
    def _on_slices(self, views: SliceViews) -> None:
        self._slices.show_head(views)

    @Slot(int)
    def _on_touching(self, touched: int) -> None:
        fiducials = self._order.scenario.fiducials
        positions = self._order.scenario.fiducial_positions()
        if touched < len(fiducials):
            how = self._order.input.touch_hint
            name = fiducials[touched].name
            self.picture.say(
                f"Touch the {name} ({touched + 1} of {len(fiducials)})",
                how,
                touched / len(fiducials),
            )
        self._overview.scene.show_fiducials(positions, touched)
        self._is_overview_stale = True

    @Slot(object)
    def _on_registered(self, residual_mm: float | None) -> None:
        self._registration_mm = residual_mm
        if residual_mm is None:
            self._notify("Ready", f"Fly with {self._order.input.name}.")
        else:
            fiducials = self._order.scenario.fiducial_positions()
            self._overview.scene.hide_fiducials(fiducials)
            self._is_overview_stale = True
            self._notify(
                "Registered", f"The touched points fit to {residual_mm:.2f} mm rms."
            )
        self.picture.mark_recording(self._order.record is not None)

    @Slot()
    def _on_frame(self) -> None:
        instant = self._flight.take()
        if instant is None:
            return
        if self._instant is None and self._seconds is not None:
            QTimer.singleShot(round(self._seconds * 1e3), self.close)
        self._instant = instant
        self._is_overview_stale = True
        self._warn()
        self.picture.show_picture(instant.pixels)

    @Slot(float)
    def _on_moment(self, time_s: float) -> None:
        self._notify(
            f"Kept the moment at {time_s:.1f} s",
            "It is being drawn at high quality, beside the flight.",
        )

    @Slot()
    def _on_away(self) -> None:
        """Leave the picture as it is and say that it is not live."""
        self._is_away = True
        self._warn()
        self.picture.say(
            "The arm is away",
            "Check its plugs and its power; the session goes on by itself.",
        )
        self._notice_until_s = float("inf")

    @Slot(float)
    def _on_back(self, away_s: float) -> None:
        self._is_away = False
        self._warn()
        self._notify("The arm is back", f"It was away for {away_s:.1f} s.")

    @Slot(object)
    def _on_landed(self, score: Score) -> None:
        self._notice_until_s = float("inf")
        contacts = "no contact" if not score.contacts else f"contacts: {score.contacts}"
        self.picture.mark_recording(False)
        self.picture.say(
            "The path is flown",
            f"{score.duration_s:.1f} s, {score.path_length_mm:.0f} mm, smallest "
            f"clearance {score.min_clearance_mm:.2f} mm, {contacts}",
        )

    @Slot()
    def _on_finished(self) -> None:
        if self._flight.error is not None:
            self.close()

    def _warn(self) -> None:
        """Ring the picture when the scope is in tissue, or when nobody can know."""
        contact = "contact" if self._readings().is_contact else ""
        self.picture.warn("not live" if self._is_away else contact)

    def _readings(self) -> Readings:
        instant = self._instant
        if instant is None:
            return Readings(registration_mm=self._registration_mm)
        return Readings(
            None if self._is_away else instant.fps,
            None if self._is_away else instant.pose_age_ms,
            instant.view.clearance_mm,
            instant.time_s,
            self._registration_mm,
        )

    @Slot()
    def _refresh(self) -> None:
        """Bring up to date what need not change with every frame."""
        now = time.monotonic()
        self._gauges.show_readings(self._readings())
        if self._notice_until_s and now >= self._notice_until_s:
            self._notice_until_s = 0.0
            self.picture.say("")
        if self._is_overview_stale and now >= self._overview_due_s:
            self._draw_overview()

    def _draw_overview(self) -> None:
        """Draw, and not again before the budget allows."""
        self._is_overview_stale = False
        begun = time.monotonic()
        if self._instant is not None:
            self._overview.scene.follow(self._instant.view)
            self._slices.follow(self._instant.view.world_from_tip[:3, 3])
        self._overview.draw()
        ended = time.monotonic()
        self._overview_due_s = ended + (ended - begun) / OVERVIEW_SHARE
