"""The page of an arm: what it says now, and the way through its registration."""

from collections.abc import Sequence
from pathlib import Path
from threading import Thread

import platformdirs
from PySide6.QtCore import Qt, Signal, Slot
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QPlainTextEdit,
    QProgressBar,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.window.connection.arm_thread import HEAD, ArmThread
from app.window.page import Page, problem_label
from app.window.page_style import page_sheet
from app.window.plain_label import PlainLabel, paragraph
from app.window.scaling import lay
from app.window.texts import later, tr
from devices.registration.registration_file import save_registration
from paravol.registration.arm_registration import Registered, RegistrationOrder
from paravol.registration.arm_watch import ArmReading
from paravol.registration.record_rows import registration_rows
from paravol.trainee.found_devices import FoundDevice
from system import UserError

ROWS = (
    later("Arm"),
    later("Home position"),
    later("Counts"),
    later("Tip"),
    later("Poses"),
    later("Noise at rest"),
    later("Pedals down"),
)
NONE = "--"
LOOKING = later("Looking for the arm…")
ABOUT = later(
    "A registration says where the arm stands beside the head. It holds until the arm "
    "is switched off or moved."
)
EMULATED = later(
    "The emulated arm goes through a registration by itself, for you to see; in "
    "flights it is registered anew each time."
)


class ConnectionPage(Page):
    """Show one of the arms that were found."""

    registered = Signal(str, Path)
    """The arm at a port was registered, into a file."""

    sheet = staticmethod(page_sheet)

    def __init__(
        self,
        devices: Sequence[FoundDevice],
        folder: Path | None = None,
        chosen: str | None = None,
    ) -> None:
        """Offer the arms among some devices, and the emulated one.

        folder: of registrations, None for the user's. chosen: port of the first.
        """
        super().__init__()
        self.setObjectName("page")
        self.title = tr("PARAVOL: connection")
        data = platformdirs.user_data_path("paravol", appauthor=False)
        self._folder = data / "registrations" if folder is None else folder
        self._ports: list[str | None] = [d.port for d in devices if d.port] + [None]
        titles = [tr(d.title) for d in devices if d.port] + [tr("Emulated arm")]
        self._problems = [tr(d.problem) for d in devices if d.port] + [""]
        self._is_registering = False
        self.arm = ArmThread()
        self.chooser = QComboBox()
        self.chooser.addItems(titles)
        if chosen is not None and chosen in self._ports:
            self.chooser.setCurrentIndex(self._ports.index(chosen))
        self.figures = {name: paragraph(NONE, "figure") for name in ROWS}
        self.problem = problem_label()
        self.state = paragraph(tr("Not registered"), "heading")
        self.step = paragraph("", "body")
        self.share = QProgressBar()
        self.share.setTextVisible(False)
        self.log = QPlainTextEdit()
        self.log.setReadOnly(True)
        self.log.setAccessibleName(tr("What to do, and what came of it"))
        self.pivot = QCheckBox(tr("Find the tip first (&pivot)"))
        self.trace = QCheckBox(tr("&Trace the skin at the end"))
        for box in (self.pivot, self.trace):
            box.setChecked(True)
        self.start = QPushButton(tr("Register"))
        self.start.setObjectName("primary")
        self.back = QPushButton(tr("Back"))
        self._lay_out()
        self.chooser.currentIndexChanged.connect(self._look)
        self.start.clicked.connect(self._switch)
        self.back.clicked.connect(self.left)
        self.arm.connected.connect(self._on_connected)
        self.arm.reading.connect(self._on_reading)
        self.arm.problem.connect(self._say_problem)
        self.arm.said.connect(self.log.appendPlainText)
        self.arm.staged.connect(self._on_stage)
        self.arm.registered.connect(self._on_registered)
        self.arm.ended.connect(self._on_ended)
        self._say_problem("")
        self._look()

    @property
    def port(self) -> str | None:
        """Return the port of the chosen arm, None for the emulated one."""
        return self._ports[self.chooser.currentIndex()]

    def _lay_out(self) -> None:
        head = QHBoxLayout()
        label = PlainLabel(tr("&Device"))
        label.setBuddy(self.chooser)
        head.addWidget(label)
        head.addWidget(self.chooser, 1)
        head.addWidget(self.back)
        table = QGridLayout()
        for row, (name, figure) in enumerate(self.figures.items()):
            table.addWidget(PlainLabel(tr(name)), row, 0)
            table.addWidget(figure, row, 1)
        table.setColumnStretch(1, 1)
        table.setRowStretch(len(ROWS), 1)
        steps = QVBoxLayout()
        steps.addWidget(self.state)
        steps.addWidget(paragraph(tr(ABOUT)))
        choices = QHBoxLayout()
        choices.addWidget(self.pivot)
        choices.addWidget(self.trace)
        choices.addStretch(1)
        steps.addLayout(choices)
        steps.addWidget(self.step)
        steps.addWidget(self.share)
        steps.addWidget(self.log, 1)
        steps.addWidget(self.start)
        middle = QHBoxLayout()
        middle.addWidget(_card(table), 2, Qt.AlignmentFlag.AlignTop)
        middle.addWidget(_card(steps), 3)
        rows = lay(QVBoxLayout(self), 16, gap=10)
        rows.addLayout(head)
        rows.addWidget(self.problem)
        rows.addLayout(middle, 1)
        self.setFocusProxy(self.start)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Obey a key that no part of the page takes."""
        match event.key():
            case Qt.Key.Key_Escape:
                self.left.emit()
            case Qt.Key.Key_F11:
                self.full_screen_wanted.emit()
            case _:
                super().keyPressEvent(event)

    def release(self) -> list[Thread]:
        """Let the arm go."""
        return [self.arm.leave()]

    @Slot()
    def _look(self) -> None:
        """Look at the chosen arm; a registration that is under way ends."""
        self._set_registering(False)
        for figure in self.figures.values():
            figure.setText(NONE)
        self._say_problem(self._problems[self.chooser.currentIndex()])
        if not self.problem.text():
            self.figures["Arm"].setText(tr(LOOKING))
            self.arm.watch(self.port)
        if self.port is None and not self.log.toPlainText():
            self.log.setPlainText(tr(EMULATED))

    @Slot()
    def _switch(self) -> None:
        """Begin a registration, or end the one that is under way."""
        if self._is_registering:
            self.log.appendPlainText(tr("Ended; nothing was written."))
            self._look()
            return
        self.log.clear()
        self._say_problem("")
        self._set_registering(True)
        self.step.setText(tr(LOOKING))
        self.arm.register(
            RegistrationOrder(
                HEAD, self.port, self.pivot.isChecked(), self.trace.isChecked()
            )
        )

    def _set_registering(self, is_on: bool) -> None:
        self._is_registering = is_on
        self.start.setText(tr("Stop") if is_on else tr("Register"))
        for part in (self.chooser, self.pivot, self.trace):
            part.setEnabled(not is_on)
        self.share.setVisible(is_on)
        self.step.setVisible(is_on)
        self.step.setText("")

    def _say_problem(self, text: str) -> None:
        if text and self.figures["Arm"].text() == tr(LOOKING):
            self.figures["Arm"].setText(NONE)
        self.problem.setText(text)
        self.problem.setVisible(bool(text))

    @Slot(str, str)
    def _on_connected(self, about: str, home: str) -> None:
        self.figures["Arm"].setText(about)
        self.figures["Home position"].setText(tr(home))

    @Slot(object)
    def _on_reading(self, reading: ArmReading) -> None:
        x, y, z = reading.tip_mm
        rate, noise = reading.rate_hz, reading.noise_mm
        texts = {
            "Counts": "  ".join(str(count) for count in reading.counts),
            "Tip": tr("{x:.1f}  {y:.1f}  {z:.1f} mm in the arm's frame", x=x, y=y, z=z),
            "Poses": NONE if rate is None else tr("{rate:.0f} a second", rate=rate),
            "Noise at rest": tr("moving")
            if noise is None
            else tr("{noise:.3f} mm rms", noise=noise),
            "Pedals down": ", ".join(tr(pedal) for pedal in reading.pedals)
            or tr("none"),
        }
        for name, text in texts.items():
            self.figures[name].setText(text)

    @Slot(str, float)
    def _on_stage(self, stage: str, share: float) -> None:
        self.step.setText(tr(stage))
        self.share.setRange(0, 100)
        self.share.setValue(round(100 * share))

    @Slot(object)
    def _on_registered(self, found: Registered) -> None:
        """Tell the figures, and write the file of a real arm."""
        record = found.record
        for name, text in registration_rows(record, found.true_mm):
            self.log.appendPlainText(f"{tr(name)}: {tr(text)}")
        told = (
            later("Registered: {rms_mm:.2f} mm rms")
            if record.within_budget
            else later("Registered: {rms_mm:.2f} mm rms, over the budget")
        )
        self.state.setText(tr(told, rms_mm=record.residual_rms_mm))
        port = self.port
        if port is None:
            return
        file = self._folder / f"{record.arm_serial}.json"
        try:
            save_registration(file, record)
        except (OSError, UserError) as error:
            self._say_problem(
                tr("{file} cannot be written: {error}.", file=file, error=error)
            )
            return
        self.log.appendPlainText(
            tr("Written to {file}; flights from here use it.", file=file)
        )
        self.registered.emit(port, file)

    @Slot()
    def _on_ended(self) -> None:
        if self._is_registering:
            self._set_registering(False)
            if not self.problem.text():
                self.arm.watch(self.port)


def _card(layout: QGridLayout | QVBoxLayout) -> QWidget:
    card = QFrame()
    card.setObjectName("card")
    card.setLayout(lay(layout, 16, gap=8))
    return card
