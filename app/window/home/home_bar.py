"""Who trains and with what, and the ways to other pages."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QPushButton, QWidget

from app.window.plain_label import PlainLabel
from app.window.scaling import Scaled, hold, lay
from app.window.texts import later, tr
from paravol.trainee.found_devices import FoundDevice
from system import UserError

NOBODY = later("no name")
SEARCHING = later(" (looking for more…)")

LEAST_LETTERS = 3
"""A chooser shows at least so much of what is chosen."""
CAPTIONED = 1000
"""From this width on, at the designed size, choosers have captions."""

_SHORT = QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon


class HomeBar(QWidget, Scaled):
    """Choose the trainee and the device."""

    trainee_chosen = Signal(str)
    """A made-up name, "" for none."""
    device_chosen = Signal(object)
    """A `FoundDevice`."""
    refused = Signal(str)
    """Why a name cannot be taken; "" when one was."""

    def __init__(self) -> None:
        super().__init__()
        brand = PlainLabel("PARAVOL", "brand")
        self.trainee = QComboBox()
        self.trainee.setEditable(True)
        self.trainee.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        self.trainee.setAccessibleName(tr("Who trains: a made-up name, or nobody"))
        self.trainee.setToolTip(tr("A name that you made up; none is needed."))
        edit = self.trainee.lineEdit()
        assert edit is not None
        edit.setPlaceholderText(tr(NOBODY))
        edit.editingFinished.connect(self._on_name)
        self.trainee.activated.connect(self._on_name)
        self.device = QComboBox()
        self.device.setAccessibleName(tr("What moves the scope"))
        self.device.activated.connect(self._on_device)
        self.recordings = QPushButton(tr("Recordings"))
        self.connection = QPushButton(tr("Connection"))
        self.connection.setToolTip(tr("Look at an arm, and register it"))
        self.settings = QPushButton(tr("Settings"))
        self.tour = QPushButton(tr("Tour (F1)"))
        self._name = ""
        self._devices: list[FoundDevice] = []
        row = lay(QHBoxLayout(self), 0, gap=8)
        hold(self.trainee, setMaximumWidth=170)
        hold(self.device, setMaximumWidth=250)
        row.addWidget(brand)
        row.addStretch(1)
        self._captions: list[QLabel] = []
        for text, chooser in (
            (tr("Who"), self.trainee),
            (tr("Steer with"), self.device),
        ):
            label = PlainLabel(text)
            label.setBuddy(chooser)
            self._captions.append(label)
            row.addWidget(label)
            # narrower than its longest words, where there is no room for them
            chooser.setSizeAdjustPolicy(_SHORT)
            chooser.setMinimumContentsLength(LEAST_LETTERS)
            row.addWidget(chooser, 100)
        for button in (self.recordings, self.connection, self.settings, self.tour):
            row.addWidget(button)

    def take_scale(self) -> None:
        """Leave out the captions where there is no room for them."""
        self._show_captions()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave out the captions where there is no room for them."""
        super().resizeEvent(event)
        self._show_captions()

    def _show_captions(self) -> None:
        for caption in self._captions:
            caption.setVisible(self.width() >= CAPTIONED * self.scale)

    def show_trainees(self, names: Sequence[str], chosen: str) -> None:
        """Offer the names that are known."""
        self._name = chosen
        self.trainee.clear()
        self.trainee.addItems(["", *names])
        self.trainee.setItemData(0, tr(NOBODY), Qt.ItemDataRole.ToolTipRole)
        self.trainee.setEditText(chosen)

    def show_devices(
        self, devices: Sequence[FoundDevice], chosen: str, *, is_all: bool
    ) -> None:
        """Offer devices; chosen: words of one. is_all: no more are looked for."""
        self._devices = list(devices)
        self.device.clear()
        for device in devices:
            problem = tr(" (not usable)") if device.problem else ""
            self.device.addItem(tr(device.title) + problem)
            place = self.device.count() - 1
            told = tr(device.problem or device.title)
            self.device.setItemData(place, told, Qt.ItemDataRole.ToolTipRole)
        if not is_all:
            self.device.setItemText(0, tr(devices[0].title) + tr(SEARCHING))
        words = [device.words for device in devices]
        self.device.setCurrentIndex(words.index(chosen) if chosen in words else 0)

    def _on_name(self) -> None:
        name = self.trainee.currentText()
        if name == self._name:
            return
        # only here: with it the store is loaded, which takes a while
        from paravol.progress.session_entry import require_name

        try:
            self._name = require_name(name)
        except UserError as error:
            self.trainee.setEditText(self._name)
            self.refused.emit(tr(str(error)))
            return
        self.refused.emit("")
        self.trainee_chosen.emit(self._name)

    def _on_device(self, place: int) -> None:
        self.device_chosen.emit(self._devices[place])
