"""Keys of the sound: on and off, louder and softer."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.texts import tr
from paravol.feedback import SoundPlayer


class SoundKeys(QObject):
    """Pass a window's keys on to the loudspeaker."""

    def __init__(
        self,
        sound: SoundPlayer,
        window: QWidget,
        notify: Callable[[str, str], None],
    ) -> None:
        """Listen to the window; notify: says a line and what it means."""
        super().__init__(window)
        self._sound = sound
        self._notify = notify
        self._problem = ""
        window.installEventFilter(self)

    def fail(self, problem: str) -> None:
        """Say why there is no sound, once; later only who asks for it is told."""
        self._problem = problem
        what, _, why = problem.partition(": ")
        self._notify(what, why)

    @property
    def is_on(self) -> bool:
        """Return whether there is something to be heard."""
        return self._sound.is_on and not self._problem

    @property
    def caption(self) -> str:
        """Return what to say of the sound beside what it tells of."""
        if self._problem:
            return tr("no sound")
        return "" if self._sound.is_on else tr("sound off")

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take what belongs to the sound; let the rest pass."""
        if not isinstance(event, QKeyEvent) or event.type() != QEvent.Type.KeyPress:
            return False
        match KEYS.action(event):
            case Act.SOUND if not event.isAutoRepeat():
                if self._problem:
                    self.fail(self._problem)
                else:
                    is_on = self._sound.switch()
                    self._notify(
                        tr("Sound on") if is_on else tr("Sound off"),
                        tr("High and quick: a hazard is near. Low: force."),
                    )
            case Act.SOUND:
                pass
            case Act.LOUDER:
                self._say_volume(self._sound.louder(1))
            case Act.SOFTER:
                self._say_volume(self._sound.louder(-1))
            case _:
                return False
        return True

    def _say_volume(self, volume: float) -> None:
        self._notify(tr("Volume {volume:.0%}", volume=volume), "")
