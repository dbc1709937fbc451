"""The controls beside a scan: which scan, which look, how it is drawn and lit."""

from collections.abc import Sequence

import msgspec
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSlider,
    QVBoxLayout,
    QWidget,
)

from app.window.plain_label import PlainLabel
from app.window.scaling import hold, lay
from app.window.texts import later, tr
from app.window.volume.transfer_editor import TransferEditor
from paravol.volume.look import VolumeLook
from paravol.volume.presets import presets
from paravol.volume.scan import Scan
from paravol.volume.volume_view import Method

METHODS = {
    later("Volume: splats, quick"): Method.SPLATS,
    later("Volume: points, quickest"): Method.POINTS,
    later("Volume: rays"): Method.RAYS,
    later("Volume: fine rays, slow"): Method.FINE_RAYS,
    later("Surface"): None,
}
"""What can be chosen, and its method; None for the surface."""

_LIGHTS = {
    later("Light from everywhere"): "ambient",
    later("Light from four sides"): "diffuse",
    later("Glints"): "specular",
}
_STEPS = 200


class VolumeControls(QWidget):
    """Let somebody choose and edit how a scan is shown."""

    changed = Signal()
    """Something else is to be drawn."""
    load_wanted = Signal()
    save_wanted = Signal()

    def __init__(self, scans: Sequence[Scan]) -> None:
        """Offer some scans; the first is shown."""
        super().__init__()
        self._scans = list(scans)
        self._is_filling = False
        self.scan_box, self.preset, self.method = QComboBox(), QComboBox(), QComboBox()
        for scan in scans:
            self.scan_box.addItem(tr(scan.title))
        self.method.addItems([tr(name) for name in METHODS])
        self.editor = TransferEditor()
        self.threshold = _slider(tr("Threshold of the fuzzy set"))
        self.surface = _slider(tr("Density of the surface"))
        self.lights = {field: _slider(tr(name)) for name, field in _LIGHTS.items()}
        self.load, self.save = (
            QPushButton(tr("Open look...")),
            QPushButton(tr("Save look...")),
        )
        self._figures: dict[QSlider, QLabel] = {}
        self._looks = presets(self._scans[0])
        self.look = self._looks[0]
        self._lay_out()
        self._fill_presets()
        self.scan_box.currentIndexChanged.connect(self._on_scan)
        self.preset.currentIndexChanged.connect(self._on_preset)
        self.method.currentIndexChanged.connect(self._on_method)
        self.editor.edited.connect(self.show_look)
        for slider in (self.threshold, self.surface, *self.lights.values()):
            slider.valueChanged.connect(self._on_slider)
        self.load.clicked.connect(self.load_wanted)
        self.save.clicked.connect(self.save_wanted)

    @property
    def scan(self) -> Scan:
        """Return the scan that is shown."""
        return self._scans[self.scan_box.currentIndex()]

    @property
    def chosen_method(self) -> Method | None:
        """Return how it is drawn; None for the surface."""
        return list(METHODS.values())[self.method.currentIndex()]

    def show_look(self, look: VolumeLook) -> None:
        """Take over a look, and have it drawn."""
        self.look = look
        self._fill()
        self.changed.emit()

    def _lay_out(self) -> None:
        column = lay(QVBoxLayout(self), gap=8)
        hold(self.editor, setMinimumHeight=150)
        form = QFormLayout()
        form.setLabelAlignment(Qt.AlignmentFlag.AlignVCenter)
        form.addRow(tr("&Scan"), self.scan_box)
        form.addRow(tr("&Look"), self.preset)
        form.addRow(tr("&Drawn as"), self.method)
        column.addLayout(form)
        column.addWidget(self.editor, 1)
        sliders = QFormLayout()
        sliders.setLabelAlignment(Qt.AlignmentFlag.AlignVCenter)
        named = {
            tr("&Threshold"): self.threshold,
            tr("S&urface at"): self.surface,
            **{tr(name): self.lights[field] for name, field in _LIGHTS.items()},
        }
        for name, slider in named.items():
            row, figure = QHBoxLayout(), PlainLabel()
            figure.setMinimumWidth(figure.fontMetrics().horizontalAdvance("-0000 HU"))
            figure.setAlignment(Qt.AlignmentFlag.AlignRight)
            self._figures[slider] = figure
            label = PlainLabel(name)
            label.setBuddy(slider)
            row.addWidget(slider, 1)
            row.addWidget(figure)
            sliders.addRow(label, row)
        column.addLayout(sliders)
        buttons = QHBoxLayout()
        buttons.addWidget(self.load)
        buttons.addWidget(self.save)
        column.addLayout(buttons)
        self._on_method_rows()

    def _fill_presets(self) -> None:
        self._is_filling = True
        self.preset.clear()
        self.preset.addItems([tr(look.name) for look in self._looks])
        self._is_filling = False
        self._fill()

    def _fill(self) -> None:
        """Put the look's figures into the controls; nothing is drawn by that."""
        self._is_filling = True
        look, scan = self.look, self.scan
        self.editor.show_look(scan, look)
        share = (look.surface - scan.low) / (scan.high - scan.low)
        self.surface.setValue(round(min(max(share, 0.0), 1.0) * _STEPS))
        self.threshold.setValue(round(look.threshold * _STEPS))
        unit = " HU" if scan.is_ct else ""
        self._figures[self.surface].setText(f"{look.surface:.0f}{unit}")
        self._figures[self.threshold].setText(f"{look.threshold:.3f}")
        for field, slider in self.lights.items():
            value = getattr(look, field)
            slider.setValue(round(value / 2.0 * _STEPS))
            self._figures[slider].setText(f"{value:.2f}")
        self._is_filling = False

    def _on_scan(self) -> None:
        self._looks = presets(self.scan)
        self.look = self._looks[0]
        self._fill_presets()
        self.changed.emit()

    def _on_preset(self, number: int) -> None:
        if not self._is_filling:
            self.show_look(self._looks[number])

    def _on_method(self) -> None:
        self._on_method_rows()
        self.changed.emit()

    def _on_method_rows(self) -> None:
        """Let only that be moved which makes a difference."""
        method = self.chosen_method
        is_splats = method is not None and method.splat_mode is not None
        self.threshold.setEnabled(is_splats)
        self.surface.setEnabled(method is None)

    def _on_slider(self) -> None:
        if self._is_filling:
            return
        scan, look = self.scan, self.look
        moved = self.sender()
        if moved is self.threshold:
            look = msgspec.structs.replace(
                look, threshold=self.threshold.value() / _STEPS
            )
        elif moved is self.surface:
            share = self.surface.value() / _STEPS
            surface = scan.low + share * (scan.high - scan.low)
            look = msgspec.structs.replace(look, surface=surface)
        else:
            for field, slider in self.lights.items():
                if moved is slider:
                    strength = {field: 2.0 * slider.value() / _STEPS}
                    look = msgspec.structs.replace(look, **strength)
        self.show_look(look)


def _slider(name: str) -> QSlider:
    slider = QSlider(Qt.Orientation.Horizontal)
    slider.setRange(0, _STEPS)
    slider.setAccessibleName(name)
    return slider
