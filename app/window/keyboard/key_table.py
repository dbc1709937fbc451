"""All actions with their keys, to be changed: choose one, press Enter, then its key."""

from collections.abc import Mapping

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QTreeWidget, QTreeWidgetItem, QWidget

from app.window.keyboard.actions import FIXED, NAMED, Act, Group
from app.window.keyboard.key_map import KEYS
from app.window.scaling import Scaled
from app.window.texts import later, tr

WAITS = later("press a key…")


class KeyTable(QTreeWidget, Scaled):
    """Show the table of actions; what is chosen holds at once."""

    chosen = Signal(object)
    """Keys of actions by their names, as `WindowPreferences` keeps them."""

    told = Signal(str)
    """What became of the last key."""

    def __init__(self, keys: Mapping[str, str], parent: QWidget) -> None:
        """Show keys; they are those of the window already."""
        super().__init__(parent)
        self.keys = dict(keys)
        self._waits: Act | None = None
        self.setAccessibleName(tr("Keys"))
        self.setColumnCount(2)
        self.setHeaderHidden(True)
        self.setRootIsDecorated(False)
        self._items: dict[Act, QTreeWidgetItem] = {}
        for group in Group:
            heading = QTreeWidgetItem(self, [tr(group.value)])
            heading.setFlags(Qt.ItemFlag.ItemIsEnabled)
            for act in Act:
                if act.row.group is group and act not in FIXED:
                    item = QTreeWidgetItem(heading, [tr(act.does)])
                    item.setData(0, Qt.ItemDataRole.UserRole, act.value)
                    self._items[act] = item
        self.expandAll()
        self.itemDoubleClicked.connect(self._ask)
        KEYS.changed.connect(self._show_keys)
        self._show_keys()

    def take_scale(self) -> None:
        """Give each action the room that its letters need."""
        self.resizeColumnToContents(0)

    def take(self, keys: Mapping[str, str]) -> None:
        """Take other keys altogether."""
        self.keys, self._waits = dict(keys), None
        self.chosen.emit(self.keys)
        self._show_keys()

    def _show_keys(self) -> None:
        for act, item in self._items.items():
            item.setText(1, tr(WAITS) if act is self._waits else KEYS.label(act))

    def _ask(self, item: QTreeWidgetItem | None) -> None:
        """Wait for the key of an action."""
        name = None if item is None else item.data(0, Qt.ItemDataRole.UserRole)
        self._waits = None if name is None else NAMED[name]
        self._show_keys()
        self.told.emit(tr("Esc leaves it as it is.") if self._waits else "")

    def event(self, event: QEvent) -> bool:
        """Have all keys while one is waited for: no button of the dialog takes them."""
        if self._waits is not None and isinstance(event, QKeyEvent):
            if event.type() == QEvent.Type.KeyPress:
                self._give(self._waits, event)
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Change the key of what is chosen by Enter."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._ask(self.currentItem())
        else:
            super().keyPressEvent(event)

    def _give(self, act: Act, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Shift, Qt.Key.Key_Control, Qt.Key.Key_Alt):
            return  # one of them alone is only half of what comes
        KEYS.printed.learn(event)
        keys, before = KEYS.given(act, event, self.keys)
        is_given = keys != self.keys
        self.take(keys)
        said = "" if before is None else f" {tr(before.does)}: {KEYS.label(before)}."
        if not is_given:
            said = tr("The key stays as it was: that one is needed.")
            said = "" if event.key() == Qt.Key.Key_Escape else said
        elif said:
            said = tr("The two have changed places.{said}", said=said)
        self.told.emit(said)
