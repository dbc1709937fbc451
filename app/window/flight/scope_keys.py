"""Keys of the scope: which angle is in hand."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.texts import tr
from paravol.inputs.scope_in_hand import ScopeInHand


class ScopeKeys(QObject):
    """Pass a window's keys on to the scopes that lie ready."""

    def __init__(
        self, scopes: ScopeInHand, window: QWidget, notify: Callable[[str, str], None]
    ) -> None:
        """Listen to the window; notify: says a line and what it means."""
        super().__init__(window)
        self._scopes = scopes
        self._notify = notify
        window.installEventFilter(self)

    @property
    def choices_deg(self) -> tuple[float, ...]:
        """Return the angles of all that may be put in."""
        return self._scopes.choices_deg

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take what belongs to the scope; let the rest pass."""
        if not isinstance(event, QKeyEvent) or event.type() != QEvent.Type.KeyPress:
            return False
        act = KEYS.action(event)
        if act not in (Act.NEXT_SCOPE, Act.PREVIOUS_SCOPE):
            return False
        if not event.isAutoRepeat():
            if len(self._scopes.choices_deg) > 1:
                self._tell(self._scopes.step(1 if act is Act.NEXT_SCOPE else -1))
            else:
                self._notify(
                    tr("There is no other scope"), tr("The exercise allows one only.")
                )
        return True

    def take(self, angle_deg: float) -> None:
        """Put in the scope of an angle."""
        self._scopes.choose(angle_deg)
        self._tell(angle_deg)

    def _tell(self, angle_deg: float) -> None:
        self._notify(
            tr("Scope of {angle_deg:g}°", angle_deg=angle_deg), scope_use(angle_deg)
        )


def scope_use(angle_deg: float) -> str:
    """Return where a scope of an angle looks, in words."""
    if angle_deg == 0.0:
        return tr("It looks straight ahead.")
    return tr(
        "It looks {angle_deg:g}° aside, towards the light post.", angle_deg=angle_deg
    )
