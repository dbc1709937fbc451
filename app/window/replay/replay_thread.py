"""A replay that a window watches: what its threads tell, as signals.

Qt delivers them in the window's thread; of the pictures only the newest is kept for it.
"""

import threading

from PySide6.QtCore import QObject, Signal

from app.errors import sentence
from app.vtk.head_model import COARSENESS, FINE, head_model
from app.window.ending import begin_ending
from paravol.patient import PatientScene
from paravol.replays.replay_worker import (
    OpenedReplay,
    ReplayObserver,
    ReplayOrder,
    ReplayWorker,
    Row,
    ShownReplay,
)
from paravol.replays.time_marks import TimeMark
from paravol.snapshots.snapshot_queue import MomentPicture
from scenarios.bundle import Note


class ReplayThread(QObject, ReplayObserver):
    """Replay one session, or two side by side, and report to a window."""

    staged = Signal(str, float)
    """What is done before the first picture, and its done share, 0 to 1."""
    opened = Signal(object)
    """An `OpenedReplay`."""
    failed = Signal(str, bool)
    """Why it cannot be shown, and whether its case is not where it was."""
    sought = Signal(float)
    """A long way to a moment, and its done share."""
    arrived = Signal()
    """There is a new picture: `take` it."""
    noted = Signal(object)
    """The notes, changed."""
    told = Signal(str, str)
    """Something was done, or could not be."""
    head_ready = Signal(object)
    """A `HeadModel`."""
    slices_ready = Signal(object)
    """`SliceViews` of the head."""
    measuring = Signal(str, float)
    """How far the measuring is."""
    near = Signal(float)
    """Up to when every moment is near; see `Keyframes`."""
    measured = Signal(object, object)
    """All marks, and the rows of metrics; see `ReplayObserver`."""
    unmeasured = Signal(str)
    """Why nothing could be measured."""
    pictured = Signal(object)
    """A `MomentPicture`: a high-quality picture, as far as it is drawn."""

    def __init__(self, order: ReplayOrder) -> None:
        """Prepare a replay; `worker.start` begins it."""
        super().__init__()
        self.worker = ReplayWorker(order, self)
        self._lock = threading.Lock()
        self._newest: ShownReplay | None = None
        self._staged = self._measuring = ("", 0.0)
        self._near_s = -1.0

    def leave(self) -> threading.Thread:
        """End what goes on; see `begin_ending`."""
        return begin_ending(self, self.worker.stop)

    def take(self) -> ShownReplay | None:
        """Take the newest picture; None when it was taken before."""
        with self._lock:
            newest, self._newest = self._newest, None
        return newest

    def on_progress(self, stage: str, share: float) -> None:
        """Report a stage; some report every step of thousands."""
        if self._is_new(stage, share):
            self.staged.emit(stage, share)

    def _is_new(self, stage: str, share: float) -> bool:
        """Return whether a share differs from the last one by a hundredth."""
        staged = stage, round(share, 2)
        before, self._staged = self._staged, staged
        return staged != before

    def on_opened(self, opened: OpenedReplay) -> None:
        """Tell the window."""
        self.opened.emit(opened)

    def on_failed(self, error: Exception, lacks_case: bool) -> None:
        """Tell the window in a sentence."""
        words = sentence(error) or f"{type(error).__name__}: {error}"
        self.failed.emit(words, lacks_case)

    def on_seeking(self, share: float) -> None:
        """Tell the window, a hundred times at most."""
        if self._is_new("seeking", share):
            self.sought.emit(share)

    def on_shown(self, shown: ShownReplay) -> None:
        """Keep the picture for the window."""
        with self._lock:
            before, self._newest = self._newest, shown
        if before is None:
            self.arrived.emit()

    def on_notes(self, notes: tuple[Note, ...]) -> None:
        """Tell the window."""
        self.noted.emit(notes)

    def on_told(self, title: str, detail: str) -> None:
        """Tell the window."""
        self.told.emit(title, detail)

    def on_background(self, patient: PatientScene) -> None:
        """Build what the overview and the slices show of the head."""
        self.slices_ready.emit(patient.slice_views())
        here = self.worker.scenario
        targets = patient.positions(here.targets)
        face = None if patient.face is None else patient.face()
        coarseness = FINE if here.head.scene else COARSENESS
        self.head_ready.emit(
            head_model(patient.surface, targets, self.worker.cutter(), face, coarseness)
        )

    def on_measuring(self, stage: str, share: float) -> None:
        """Tell the window, a hundred times at most."""
        told = stage, round(share, 2)
        before, self._measuring = self._measuring, told
        if told != before:
            self.measuring.emit(stage, share)

    def on_near(self, until_s: float) -> None:
        """Tell the window what is new."""
        if until_s != self._near_s:
            self._near_s = until_s
            self.near.emit(until_s)

    def on_measured(self, marks: list[TimeMark], rows: list[Row]) -> None:
        """Tell the window."""
        self.measured.emit(marks, rows)

    def on_unmeasured(self, problem: str) -> None:
        """Tell the window."""
        self.unmeasured.emit(problem)

    def on_picture(self, picture: MomentPicture) -> None:
        """Tell the window."""
        self.pictured.emit(picture)
