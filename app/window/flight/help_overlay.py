"""All keys of a flight, over the page: F1 or ? shows and hides them."""

from collections.abc import Callable, Mapping, Sequence

from PySide6.QtCore import QEvent, QObject, Qt, Signal, Slot
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.plain_label import PlainLabel, paragraph
from app.window.scaling import Scaled, lay
from app.window.texts import tr

COLUMNS = 3

Rows = Sequence[tuple[str, str]]
"""Keys, and what they do."""


class HelpOverlay(QWidget, Scaled):
    """Lie over a page with groups of keys and what they do; hidden at first."""

    switched = Signal(bool)
    """The keys are shown, or no longer."""

    def __init__(self, page: QWidget, told: Callable[[], Mapping[str, Rows]]) -> None:
        """Lay groups of keys out, each below its name; empty ones are left out.

        told: says them, and says them again when keys have changed.
        """
        super().__init__(page)
        self._told = told
        self._keys: list[QLabel] = []
        self.setObjectName("help")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        rows = lay(QVBoxLayout(self), 22, 14, 22, 14, gap=8)
        title = PlainLabel(tr("Keys and mouse"), "title")
        rows.addWidget(title)
        columns = lay(QHBoxLayout(), gap=22)
        rows.addLayout(columns)
        for column in _balanced({n: g for n, g in told().items() if g}):
            stack = QVBoxLayout()
            for name, keys in column:
                stack.addLayout(self._table(name, keys))
            stack.addStretch(1)
            columns.addLayout(stack, 1)
        self._closing = PlainLabel()
        rows.addWidget(self._closing)
        page.installEventFilter(self)
        KEYS.changed.connect(self._tell)
        self._tell()
        self.hide()

    @Slot()
    def _tell(self) -> None:
        """Name the keys as they are now."""
        shown = [key for group in self._told().values() for key, _ in group]
        for label, key in zip(self._keys, shown, strict=True):
            label.setText(tr(key))
        key = KEYS.label(Act.HELP)
        self._closing.setText(
            tr("{key}, ? or Esc hides this. The clock stands meanwhile.", key=key)
        )

    def _table(self, name: str, keys: Rows) -> QGridLayout:
        table = lay(QGridLayout(), 0, 0, 0, 10, gap=(4, 2))
        table.setColumnStretch(1, 1)
        heading = PlainLabel(tr(name), "task")
        table.addWidget(heading, 0, 0, 1, 2)
        for row, (key, does) in enumerate(keys, 1):
            left = PlainLabel(tr(key), "key")
            self._keys.append(left)
            table.addWidget(left, row, 0, Qt.AlignmentFlag.AlignTop)
            table.addWidget(paragraph(tr(does)), row, 1, Qt.AlignmentFlag.AlignTop)
        return table

    def take_scale(self) -> None:
        """Lie in the middle, as large as is needed now."""
        self._place()

    def switch(self) -> None:
        """Show the keys, or hide them."""
        self.setVisible(self.isHidden())
        if not self.isHidden():
            self._place()
            self.raise_()
        self.switched.emit(not self.isHidden())

    def _place(self) -> None:
        """Lie in the middle of the page, as large as is needed and there is room."""
        page = self.parentWidget()
        if page is None or self.isHidden():
            return
        room = page.rect()
        margin = max(room.width() // 40, 1)
        room.adjust(margin, margin, -margin, -margin)
        width = min(room.width(), max(self.sizeHint().width(), room.width() * 4 // 5))
        height = min(max(self.heightForWidth(width), 1), room.height())
        self.resize(width, height)
        self.move(
            room.center() - self.rect().center(),
        )

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in the middle of the page."""
        if event.type() == QEvent.Type.Resize:
            self._place()
        return False

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Go away."""
        self.switch()


def _balanced(
    groups: Mapping[str, Rows],
) -> list[list[tuple[str, Rows]]]:
    """Share groups out over columns of about one height, in their order."""
    sizes = [len(keys) + 2 for keys in groups.values()]
    columns: list[list[tuple[str, Rows]]] = [[]]
    taken, each = 0, sum(sizes) / COLUMNS
    for size, group in zip(sizes, groups.items(), strict=True):
        if columns[-1] and taken + size / 2 > each * len(columns) < each * COLUMNS:
            columns.append([])
        columns[-1].append(group)
        taken += size
    return columns
