"""What the threads of a flight and of a replay tell a window, both alike.

Qt delivers it in the window's thread; of the pictures only the newest is kept for it.
"""

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from PySide6.QtCore import QObject, Signal

from paravol.slices.slice_views import SliceViews

if TYPE_CHECKING:
    from app.vtk.head_model import HeadModel

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class HeadModelled:
    """The overview's head is there."""

    model: "HeadModel"


@dataclass(frozen=True, slots=True)
class SlicesReady:
    """The slices' head is there."""

    views: SliceViews


@dataclass(frozen=True, slots=True)
class FrameReady:
    """There is a new picture: `SessionThread.take` it."""


class SessionThread(QObject, Generic[T]):
    """Tell a window of a session that threads fly or replay."""

    told = Signal(object)
    """What happens: an event for each kind of thing."""

    def __init__(self) -> None:
        super().__init__()
        self._lock = threading.Lock()
        self._newest: T | None = None
        self._news: dict[type, object] = {}

    def take(self) -> T | None:
        """Take the newest picture; None when it was taken before."""
        with self._lock:
            newest, self._newest = self._newest, None
        return newest

    def _keep(self, newest: T) -> None:
        """Keep a picture for the window, in place of one that it never took."""
        with self._lock:
            before, self._newest = self._newest, newest
        if before is None:
            self.told.emit(FrameReady())

    def _tell_news(self, event: object) -> None:
        """Tell a step, once; some report every one of thousands."""
        kind = type(event)
        if self._news.get(kind) != event:
            self._news[kind] = event
            self.told.emit(event)
