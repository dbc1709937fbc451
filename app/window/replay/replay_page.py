"""The page of a replay: one session, or two side by side, at any moment."""

import math
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt, Slot
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QHBoxLayout,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.errors import sentence
from app.window.keyboard import key_map
from app.window.keyboard.places import american, place_of
from app.window.page import problem_label
from app.window.page_style import replay_sheet
from app.window.panels.endoscope_panel import PictureView
from app.window.replay.own_view import MOVES, LookEvents
from app.window.replay.replay_side import ReplaySide, caption
from app.window.replay.replay_thread import ReplayThread, ReplayWindowEvent
from app.window.replay.time_line import TimeLine, clock_text
from app.window.replay.transport import Transport
from app.window.replay.welcome_card import WelcomeCard
from app.window.scaling import lay, scale_all
from app.window.session_page import SessionPage
from app.window.session_thread import FrameReady, HeadModelled, SlicesReady
from app.window.texts import later, tr
from devices.port import HostClock
from paravol.flight.flight_events import Progressed
from paravol.scoring.readings import Readings
from paravol.sessions.free_camera import CameraMove
from paravol.sessions.player import Player
from paravol.sessions.replay_events import (
    Measured,
    Measuring,
    Near,
    NotesChanged,
    OpenedReplay,
    ReplayFailed,
    ReplayOrder,
    Seeking,
    ShownReplay,
    Told,
    Unmeasured,
)
from paravol.sessions.time_marks import TimeMark, next_mark, note_marks
from paravol.snapshots.snapshot_queue import MomentPicture
from scenarios.bundle import Note
from scenarios.instrument_state import NO_TOOL

TICK_MS = 15
OVERVIEW_SHARE = 0.15
"""Largest part of the time for drawing the overview, where OpenGL is software."""

OVERVIEW_MS = 100
LONG_STEP_S = 1.0

Keys = dict[Qt.Key, Callable[[], object]]
"""What keys do, by the letters of an American keyboard."""


class ReplayPage(SessionPage):
    """Replay sessions that are dropped, chosen or named."""

    sheet = staticmethod(replay_sheet)

    _side: ReplaySide | None = None

    def __init__(self, *, edge_samples: int = 0) -> None:
        """Wait for a session; edge_samples: samples a pixel in the overview."""
        super().__init__(TICK_MS)
        self.title = tr("PARAVOL: replay")
        self._edge_samples = edge_samples
        self._thread: ReplayThread | None = None
        self._opening: ReplayThread | None = None
        self._opened: OpenedReplay | None = None
        self._refused: ReplayOrder | None = None
        self._player: Player | None = None
        self._seen: ShownReplay | None = None
        self._jump = 0
        self._plays_on = False
        self._is_free = False
        self._wanted_s = 0.0
        self._is_told_to_go = False
        self._marks: list[TimeMark] = []
        self._endings: list[threading.Thread] = []
        self.beside = PictureView()
        self._captions = caption(), caption()
        self.line, self.transport = TimeLine(), Transport()
        self.welcome = WelcomeCard()
        self.problem = problem_label()
        self.find_case = QPushButton(tr("Find its case…"))
        self.find_case.hide()
        self._looks = [
            LookEvents(picture, self._look) for picture in (self.picture, self.beside)
        ]
        self._lay_out()
        self._connect()
        self._keys = self._page_keys()
        self._show_welcome(True)

    def _lay_out(self) -> None:
        self._pictures = QWidget()
        pictures = QHBoxLayout(self._pictures)
        pictures.setContentsMargins(0, 0, 0, 0)
        pictures.setSpacing(2)
        self._halves = []
        for picture, words in zip(
            (self.picture, self.beside), self._captions, strict=True
        ):
            half = QWidget()
            column = lay(QVBoxLayout(half), 0, gap=0)
            column.addWidget(picture, 1)
            column.addWidget(words)
            pictures.addWidget(half, 1)
            self._halves.append(half)
        self._halves[1].hide()
        refusal = QHBoxLayout()
        refusal.addWidget(self.problem, 1)
        refusal.addWidget(self.find_case)
        left = lay(QVBoxLayout(), gap=0)
        left.addLayout(refusal)
        left.addWidget(self.welcome, 1)
        left.addWidget(self._pictures, 1)
        for part in (self._bars, self.line, self.transport):
            left.addWidget(part)
        self._middle = lay(QHBoxLayout(), gap=0)
        self._middle.addLayout(left, 5)
        rows = lay(QVBoxLayout(self), 0, gap=0)
        rows.addLayout(self._middle, 1)
        rows.addWidget(self._gauges)

    def _show_welcome(self, is_empty: bool) -> None:
        """Offer sessions while none is open, else what belongs to one."""
        self.welcome.setVisible(is_empty)
        below = self._bars, self.line, self.transport, self._gauges
        for part in (self._pictures, *below):
            part.setVisible(not is_empty)
        if not is_empty:
            self.setFocus()  # what had it may be gone

    def _connect(self) -> None:
        self.line.sought.connect(self.seek)
        bar = self.transport
        bar.played.connect(self.play_or_pause)
        bar.stepped.connect(self.step)
        bar.event_wanted.connect(self.go_to_event)
        bar.sped.connect(self._take_speed)
        bar.own.clicked.connect(self.switch_view)
        bar.keep.clicked.connect(self.keep_moment)
        bar.note.clicked.connect(self._write_note)
        bar.compare.clicked.connect(self._ask_beside)
        bar.align.activated.connect(self._take_alignment)
        bar.open.clicked.connect(self._ask_bundle)
        bar.leave.clicked.connect(self.left)
        self.find_case.clicked.connect(self._ask_case)
        self.welcome.open.clicked.connect(self._ask_bundle)
        self.welcome.leave.clicked.connect(self.left)
        self.welcome.chosen.connect(lambda folder: self.open([folder]))

    # What is replayed

    def open(self, bundles: Sequence[Path]) -> None:
        """Open a bundle, or two to compare; what is shown stays until it is there."""
        first, *others = [bundle_of(path) for path in bundles]
        self.replay(ReplayOrder(first, others[0] if others else None))

    def compare_with(self, bundle: Path) -> None:
        """Show another session beside the one that is shown."""
        if self._opened is not None:
            order = self._opened.order
            self.replay(replace(order, beside=bundle_of(bundle)))

    def replay(self, order: ReplayOrder) -> None:
        """Open what is ordered; what is shown stays until it is there."""
        if self._opening is not None:
            self._endings.append(self._opening.leave())
        if self._thread is not None:
            head = self._thread.worker.pristine
            order = replace(order, patient=head)
        self._refuse("")
        self._show_welcome(False)
        self._opening = thread = ReplayThread(order)
        thread.told.connect(self._hear)
        self._say_stage(later("Opening the session"), 0.0)
        thread.worker.start()

    def _say_stage(self, stage: str, share: float) -> None:
        self._notices.say(
            tr(stage), tr("This is quick once it was done before."), share
        )

    @Slot(object)
    def _hear(self, event: ReplayWindowEvent) -> None:
        """Show what happens in the replay that is opened or shown, in none before."""
        thread = self.sender()
        if thread is self._opening:
            self._hear_opening(self._opening, event)
        elif thread is self._thread and self._side is not None:
            self._hear_opened(self._side, event)

    def _hear_opening(self, thread: ReplayThread, event: ReplayWindowEvent) -> None:
        match event:
            case Progressed(stage, share):
                self._say_stage(stage, share)
            case OpenedReplay():
                if self._thread is not None:
                    self._endings.append(self._thread.leave())
                self._thread, self._opening = thread, None
                self._show_opened(event)
            case ReplayFailed():
                self._refused = thread.worker.order
                self._endings.append(thread.leave())
                self._opening = None
                self._show_failure(event)

    def _hear_opened(self, side: ReplaySide, event: ReplayWindowEvent) -> None:
        match event:
            case FrameReady():
                self._show_newest(side)
            case Seeking(share):
                self._is_told_to_go = True
                self._notices.say(
                    tr("Going there"), tr("A later wish overtakes this one."), share
                )
            case Told(title, detail):
                self._notices.notify(tr(title), tr(detail))
            case HeadModelled(model):
                side.overview.show_head(model)
            case SlicesReady(views):
                side.slices.show_head(views)
                self._is_stale = True
            case Measuring(stage, share):
                side.metrics.say(f"{tr(stage)}: {share:.0%}")
                self._gauges.show_status(
                    tr("Measuring the session: {share:.0%}", share=share)
                )
            case Near(until_s):
                self.line.show_near(until_s)
            case Measured(marks, rows):
                self._marks = [*marks, *(m for m in self._marks if m.kind == "notes")]
                self.line.show_marks(self._marks)
                side.events.show_moments((mark.time_s, tr(mark.text)) for mark in marks)
                side.metrics.show_rows(rows)
                self._gauges.show_status(tr("F1: all keys"))
            case Unmeasured(why):
                side.metrics.say(tr("Not measured"), tr(why))
                self._gauges.show_status("")
            case NotesChanged(notes):
                self._show_notes(side, notes)
            case MomentPicture():
                side.moments.show_moment(event)
            case ReplayFailed():
                self._show_failure(event)

    def _show_opened(self, opened: OpenedReplay) -> None:
        self._opened, self._seen = opened, None
        self.transport.set_ready(True)
        side = self._show_side(opened)
        self._notices.say("")
        times = opened.frame_times_s
        if times[-1] < opened.end_s:
            times = [*times, opened.end_s]
        speed = self.transport.speed.currentData()
        self._player = Player(times, HostClock(), speed=speed)
        self._keys |= self._session_keys(side, self._player)
        self.line.show_session(opened.begin_s, opened.end_s)
        self._show_notes(side, opened.notes)
        self._halves[1].setVisible(opened.order.beside is not None)
        self.transport.align.setVisible(opened.order.beside is not None)
        self.transport.align.setCurrentIndex(0)
        self.transport.own.setChecked(False)
        self._is_free = False
        self._plays_on = False
        if opened.has_damage:
            self._notices.notify(
                tr("A part of this recording is lost"), tr("The rest is shown.")
            )
        elif not opened.is_complete:
            self._notices.notify(
                tr("This recording ends in the middle"),
                tr("What was recorded is shown."),
            )
        self._go(self._player.begin_s)

    def _show_side(self, opened: OpenedReplay) -> ReplaySide:
        """Make the column anew: overview and tasks belong to one exercise."""
        before = self._side
        self._side = side = ReplaySide(opened.scenario, self._edge_samples)
        self._take_side(side)
        side.events.sought.connect(self.seek)
        side.book.notes.sought.connect(self.seek)
        side.book.written.connect(self._note)
        side.book.removed.connect(self._remove_note)
        side.events.show_moments((mark.time_s, tr(mark.text)) for mark in opened.marks)
        side.metrics.say(tr("Being measured"))
        self._marks = list(opened.marks)
        if before is not None:
            self._middle.removeWidget(before)
            before.overview.release()
            before.deleteLater()
        self._middle.addWidget(side, 3)
        scale_all(side, self.scale)
        return side

    def _show_failure(self, failure: ReplayFailed) -> None:
        """Say why something cannot be shown; what was shown before stays."""
        error = failure.error
        words = sentence(error) or f"{type(error).__name__}: {error}"
        self._refuse(words, failure.lacks_case)
        if self._thread is None:
            self._show_welcome(True)
        self._notices.say("")

    def _refuse(self, problem: str, lacks_case: bool = False) -> None:
        self.problem.setText(tr(problem))
        self.problem.setVisible(bool(problem))
        self.find_case.setVisible(lacks_case)

    @Slot()
    def _ask_bundle(self) -> None:
        if folder := self._ask(tr("Open a recorded session")):
            self.open([folder])

    @Slot()
    def _ask_beside(self) -> None:
        if self._opened is None:
            return
        if folder := self._ask(tr("Compare with a session")):
            self.compare_with(folder)

    @Slot()
    def _ask_case(self) -> None:
        refused = self._refused
        if refused is not None and (folder := self._ask(tr("Where is its case?"))):
            self.replay(replace(refused, case=folder))

    def _ask(self, title: str) -> Path | None:
        begin = str(self._opened.order.folder.parent) if self._opened else ""
        chosen = QFileDialog.getExistingDirectory(self, title, begin)
        return Path(chosen) if chosen else None

    # Where one is in it

    def play_or_pause(self) -> None:
        """Play on, from the begin where the end was reached; or stand here."""
        player = self._player
        if player is None:
            return
        if player.is_playing or self._plays_on:
            player.pause()
            self._plays_on = False
        elif player.is_over:
            self._plays_on = True
            self._go(player.begin_s)
        else:
            player.play()
        self._tell_position()

    def seek(self, time_s: float) -> None:
        """Go to a time; a playback goes on from there."""
        if self._player is not None:
            self._plays_on = self._player.is_playing or self._plays_on
            self._go(time_s)

    def step(self, frames: int) -> None:
        """Stand so many recorded frames ahead, or back."""
        if self._player is not None:
            self._plays_on = False
            self._player.step(frames)
            self._go(self._player.position_s)

    def go_to_event(self, step: int) -> None:
        """Go to the next event (1), or to the one before (-1)."""
        if self._player is None:
            return
        mark = next_mark(self._marks, self._player.position_s, step)
        if mark is None:
            none = [tr("There is no earlier event"), tr("There is no later event")]
            self._notices.notify(none[step > 0], "")
            return
        self.seek(mark.time_s)
        self._notices.notify(
            tr(mark.text),
            tr("{kind} at {time_s:.1f} s", kind=tr(mark.kind), time_s=mark.time_s),
        )

    def _go(self, time_s: float) -> None:
        """Jump; the clock stands until the moment is shown."""
        assert self._player is not None
        assert self._thread is not None
        self._player.pause()
        self._player.seek(time_s)
        self._wanted_s = self._player.position_s
        self._jump = self._thread.worker.jump_to(self._wanted_s)
        self._tell_position()

    @Slot(float)
    def _take_speed(self, speed: float) -> None:
        if self._player is not None:
            self._player.speed = speed
        self._notices.notify(tr("Speed {speed:g}x", speed=speed), "")

    @Slot()
    def _tick(self) -> None:
        """Ask for the moment that is due; show what need not follow every picture."""
        player, thread = self._player, self._thread
        if player is not None and thread is not None and player.is_playing:
            position_s = player.position_s
            if position_s != self._wanted_s:
                self._wanted_s = position_s
                thread.worker.show(position_s)
            if player.is_over:
                player.pause()
            self._tell_position()
        super()._tick()

    def _tell_position(self) -> None:
        player, opened = self._player, self._opened
        if player is None or opened is None:
            return
        self.line.show_time(player.position_s)
        self.transport.show_clock(player.position_s, opened.end_s)
        self.transport.show_playing(player.is_playing or self._plays_on)

    # What is shown of it

    def _show_newest(self, side: ReplaySide) -> None:
        shown = None if self._thread is None else self._thread.take()
        if shown is None:
            return
        is_first = self._seen is None
        self._seen = shown
        for picture, moment in (
            (self.picture, shown.here),
            (self.beside, shown.there),
        ):
            if moment is not None:
                self._show_view(picture, moment.view, moment.frame.pixels)
        self._say_what_is_shown(shown)
        self._bars.show_signs(shown.here.signs)
        self._point_at(shown.pointer, shown.here.signs)
        self._gauges.show_readings(_readings(shown))
        side.tasks.show_states(shown.here.tasks)
        side.show_tool(shown.here.sample.instrument)
        if shown.tissue_changed and not is_first:
            side.refresh()
        self._is_stale = True
        if shown.jump == self._jump and self._player is not None:
            if self._is_told_to_go:
                self._is_told_to_go = False
                self._notices.say("")
            if self._plays_on:
                self._plays_on = False
                self._player.play()
            self._tell_position()

    def _say_what_is_shown(self, shown: ShownReplay) -> None:
        here, there, opened = shown.here, shown.there, self._opened
        assert opened is not None
        order, frame = opened.order, here.recorded
        words = tr("between two recorded frames")
        if shown.is_free:
            words = tr("own view: V goes back")
        elif here.is_recorded is not None and frame is not None:
            same, other = tr("the same bits as in flight"), tr("DIFFERS")
            words = tr(
                "frame {number}: {same}",
                number=frame.number,
                same=same if here.is_recorded else other,
            )
        self.transport.say(words)
        first, second = self._captions
        first.setText(f"{order.folder.name} · {clock_text(here.sample.time_s)}")
        if there is not None and order.beside is not None:
            second.setText(f"{order.beside.name} · {clock_text(there.sample.time_s)}")

    def _draw_overview(self) -> None:
        """Draw slices, have the overview drawn; not again before the budget allows."""
        self._is_stale = False
        side, shown = self._side, self._seen
        if side is None:
            return
        self._overview_due_s = math.inf
        view = None
        if shown is not None:
            view = shown.here.view
            tool_mm = view.world_from_instrument[:3, 3]
            has_tool = view.instrument != NO_TOOL and np.all(np.isfinite(tool_mm))
            side.slices.follow(view.camera.frame[0], tool_mm if has_tool else None)
        side.overview.draw(view)

    @Slot(float)
    def _on_overview_drawn(self, took_s: float) -> None:
        waits_s = max(took_s / OVERVIEW_SHARE, OVERVIEW_MS / 1e3)
        self._overview_due_s = time.monotonic() + waits_s

    def _show_notes(self, side: ReplaySide, notes: Sequence[Note]) -> None:
        side.book.notes.show_moments((note.at_s, note.text) for note in notes)
        self._marks = [m for m in self._marks if m.kind != "notes"]
        self._marks += note_marks(notes)
        self.line.show_marks(self._marks)

    # What can be done beside

    def switch_view(self) -> None:
        """Leave the recorded view, or come back to it."""
        if self._thread is None or self._seen is None:
            self.transport.own.setChecked(False)
            return
        self._is_free = not self._is_free
        self.transport.own.setChecked(self._is_free)
        self._thread.worker.leave_view(self._is_free)
        if self._is_free:
            keys = " ".join(key_map.KEYS.printed[place] for place in "WSAD")
            self._notices.notify(
                tr("Your own view"),
                tr("Drag looks around, {keys} and the wheel go · V: back", keys=keys),
            )
        else:
            self._notices.notify(tr("The recorded view"), "")

    def _look(self, move: CameraMove) -> None:
        """Look elsewhere; who drags in the recorded view leaves it."""
        if self._thread is None or self._seen is None:
            return
        if not self._is_free:
            self.switch_view()
        self._thread.worker.look(move)

    def keep_moment(self) -> None:
        """Have what is shown drawn at high quality."""
        if self._thread is not None:
            self._thread.worker.keep()

    @Slot()
    def _write_note(self) -> None:
        if self._side is not None and self._player is not None:
            self._plays_on = False
            self._player.pause()
            self._tell_position()
            self._side.write_note()

    @Slot(str)
    def _note(self, text: str) -> None:
        if self._thread is not None and self._player is not None:
            self._thread.worker.note(max(self._player.position_s, 0.0), text)
            self.setFocus()

    @Slot(int)
    def _remove_note(self, number: int) -> None:
        if self._thread is not None:
            self._thread.worker.remove_note(number)

    def _change_alignment(self) -> None:
        align = self.transport.align
        if align.isVisible():
            align.setCurrentIndex(1 - align.currentIndex())
            self._take_alignment()

    @Slot()
    def _take_alignment(self) -> None:
        """Tie the sessions together as chosen; say what by."""
        if self._thread is None or self._opened is None:
            return
        by_landmarks = self.transport.align.currentIndex() == 0
        self._thread.worker.align_by(landmarks=by_landmarks)
        names = "; ".join(map(tr, self._opened.aligned_by))
        if by_landmarks:
            title = tr("Aligned by landmarks")
            detail = names or tr("nothing that both reached")
        else:
            title, detail = tr("Aligned by time"), tr("from their first moments on")
        self._notices.notify(title, detail)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Obey a key."""
        key, place = american(event), place_of(event)
        if self._is_free and place in MOVES:
            self._look(MOVES[place])
            return
        is_long = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        match key:
            case Qt.Key.Key_Left | Qt.Key.Key_Right:
                self._step_key(-1 if key == Qt.Key.Key_Left else 1, is_long)
            case Qt.Key.Key_Escape if self._is_writing:
                self.setFocus()
            case Qt.Key.Key_Escape if self._is_free:
                self.switch_view()
            case Qt.Key.Key_Escape if self.window().isFullScreen():
                self.full_screen_wanted.emit()
            case _ if key in self._keys:
                self._keys[key]()
            case _:
                super().keyPressEvent(event)

    def _page_keys(self) -> Keys:
        """Return what keys do that a session does not change."""
        key, bar = Qt.Key, self.transport
        return {
            key.Key_Space: self.play_or_pause,
            key.Key_Up: partial(bar.change_speed, 1),
            key.Key_Down: partial(bar.change_speed, -1),
            key.Key_PageUp: partial(self.go_to_event, -1),
            key.Key_PageDown: partial(self.go_to_event, 1),
            key.Key_Q: self.left.emit,
            key.Key_Escape: self.left.emit,
            key.Key_F: self.full_screen_wanted.emit,
            key.Key_V: self.switch_view,
            key.Key_K: self.keep_moment,
            key.Key_N: self._write_note,
            key.Key_B: self._ask_beside,
            key.Key_L: self._change_alignment,
            key.Key_O: self._ask_bundle,
        }

    def _session_keys(self, side: ReplaySide, player: Player) -> Keys:
        """Return what keys do in a session, and with what stands beside it."""
        key, notify = Qt.Key, self._notices.notify
        return {
            key.Key_Home: partial(self.seek, player.begin_s),
            key.Key_End: partial(self.seek, player.end_s),
            key.Key_M: lambda: notify(side.slices.switch(), ""),
            key.Key_C: lambda: notify(side.overview.switch(), ""),
            key.Key_F1: side.show_keys,
            key.Key_I: side.tasks.switch_hint,
        }

    @property
    def _is_writing(self) -> bool:
        return self._side is not None and self._side.book.line.hasFocus()

    def _step_key(self, step: int, is_long: bool) -> None:
        if is_long and self._player is not None:
            self.seek(self._player.position_s + LONG_STEP_S * step)
        else:
            self.step(step)

    def release(self) -> list[threading.Thread]:
        """End the replay; free the overview's graphics memory."""
        for thread in (self._opening, self._thread):
            if thread is not None:
                self._endings.append(thread.leave())
        return [*self._endings, *super().release()]


def bundle_of(path: Path) -> Path:
    """Return the bundle that a path means: itself, or the one that a file is of."""
    return path.parent if path.is_file() and path.parent.suffix else path


def _readings(shown: ShownReplay) -> Readings:
    view = shown.here.view
    return Readings(
        clearance_mm=view.clearance_mm,
        time_s=shown.here.sample.time_s,
        hazard=view.hazard,
        has_hazards=view.hazard is not None,
        drags_mm=view.drags_mm,
    )
