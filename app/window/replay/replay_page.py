"""The page of a replay: one session, or two side by side, at any moment."""

import math
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt, QTimer, Signal, Slot
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QHBoxLayout,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.vtk.head_model import HeadModel
from app.window.keyboard import key_map
from app.window.keyboard.places import american, place_of
from app.window.page import Page, problem_label
from app.window.page_style import replay_sheet
from app.window.panels.endoscope_panel import PictureView
from app.window.panels.gauges import Gauges
from app.window.panels.notices import Notices
from app.window.panels.touch_bars import TouchBars, hazard_look
from app.window.replay.own_view import MOVES, LookEvents
from app.window.replay.replay_side import ReplaySide, caption
from app.window.replay.replay_thread import ReplayThread
from app.window.replay.time_line import TimeLine, clock_text
from app.window.replay.transport import Transport
from app.window.replay.welcome_card import WelcomeCard
from app.window.scaling import lay, scale_all
from app.window.texts import later, tr
from devices.port import HostClock
from paravol.player import Player
from paravol.readings import Readings
from paravol.replays.free_camera import CameraMove
from paravol.replays.replay_worker import OpenedReplay, ReplayOrder, Row, ShownReplay
from paravol.replays.time_marks import TimeMark, next_mark, note_marks
from paravol.session_pictures import ShownMoment
from paravol.side_letters import looks_towards, side_letters
from paravol.slice_views import SliceViews
from paravol.snapshots.snapshot_queue import MomentPicture
from scenarios.bundle import Note
from scenarios.instrument_state import NO_TOOL

TICK_MS = 15
OVERVIEW_SHARE = 0.15
"""Largest part of the time for drawing the overview, where OpenGL is software."""

OVERVIEW_MS = 100
LONG_STEP_S = 1.0


class ReplayPage(Page):
    """Replay sessions that are dropped, chosen or named."""

    shown = Signal()
    """A picture is there."""

    sheet = staticmethod(replay_sheet)

    def __init__(self, bundles: Sequence[Path] = (), *, edge_samples: int = 0) -> None:
        """Open one bundle, or two to compare; none waits for one to be dropped.

        edge_samples: samples a pixel for smooth edges in the overview.
        """
        super().__init__()
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
        self._side: ReplaySide | None = None
        self._is_stale = False
        self._overview_due_s = 0.0
        self.picture, self.beside = PictureView(), PictureView()
        self._captions = caption(), caption()
        self._notices = Notices(self.picture)
        self._bars, self._gauges = TouchBars(), Gauges()
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
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._tick)
        self._timer.start(TICK_MS)
        self._show_welcome(True)
        if bundles:
            self.open(bundles)

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
        thread.staged.connect(self._on_stage)
        thread.opened.connect(self._on_opened)
        thread.failed.connect(self._on_failed)
        thread.sought.connect(self._on_sought)
        thread.arrived.connect(self._on_arrived)
        thread.noted.connect(self._on_notes)
        thread.told.connect(self._on_told)
        thread.head_ready.connect(self._on_head)
        thread.slices_ready.connect(self._on_slices)
        thread.measuring.connect(self._on_measuring)
        thread.near.connect(self._on_near)
        thread.measured.connect(self._on_measured)
        thread.unmeasured.connect(self._on_unmeasured)
        thread.pictured.connect(self._on_pictured)
        self._on_stage(later("Opening the session"), 0.0)
        thread.worker.start()

    def _is_left(self) -> bool:
        """Return whether a signal comes from a replay that is shown no longer."""
        return self.sender() is not self._thread

    @Slot(str, float)
    def _on_stage(self, stage: str, share: float) -> None:
        self._notices.say(
            tr(stage), tr("This is quick once it was done before."), share
        )

    @Slot(object)
    def _on_opened(self, opened: OpenedReplay) -> None:
        if self.sender() is not self._opening:
            return
        before, self._thread, self._opening = self._thread, self._opening, None
        if before is not None:
            self._endings.append(before.leave())
        self._opened, self._seen = opened, None
        self.transport.set_ready(True)
        self._show_side(opened)
        self._notices.say("")
        times = opened.frame_times_s
        if times[-1] < opened.end_s:
            times = [*times, opened.end_s]
        speed = self.transport.speed.currentData()
        self._player = Player(times, HostClock(), speed=speed)
        self.line.show_session(opened.begin_s, opened.end_s)
        self._on_notes(opened.notes)
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

    def _show_side(self, opened: OpenedReplay) -> None:
        """Make the column anew: overview and tasks belong to one exercise."""
        before = self._side
        self._side = side = ReplaySide(opened.scenario, self._edge_samples)
        side.overview.changed.connect(self._on_overview_changed)
        side.overview.drawn.connect(self._on_overview_drawn)
        side.events.sought.connect(self.seek)
        side.book.sought.connect(self.seek)
        side.book.written.connect(self._note)
        side.book.removed.connect(self._remove_note)
        side.events.show_marks(opened.marks)
        side.metrics.say(tr("Being measured"))
        self._marks = list(opened.marks)
        if before is not None:
            self._middle.removeWidget(before)
            before.overview.release()
            before.deleteLater()
        self._middle.addWidget(side, 3)
        scale_all(side, self.scale)

    @Slot(str, bool)
    def _on_failed(self, problem: str, lacks_case: bool) -> None:
        """Say why something cannot be shown; what was shown before stays."""
        sender = self.sender()
        if sender is self._opening and self._opening is not None:
            self._refused = self._opening.worker.order
            self._endings.append(self._opening.leave())
            self._opening = None
        elif sender is not self._thread:
            return
        self._refuse(problem, lacks_case)
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
        self._notices.refresh()
        if self._is_stale and time.monotonic() >= self._overview_due_s:
            self._draw_overview()

    def _tell_position(self) -> None:
        player, opened = self._player, self._opened
        if player is None or opened is None:
            return
        self.line.show_time(player.position_s)
        self.transport.show_clock(player.position_s, opened.end_s)
        self.transport.show_playing(player.is_playing or self._plays_on)

    # What is shown of it

    @Slot(float)
    def _on_sought(self, share: float) -> None:
        if not self._is_left():
            self._is_told_to_go = True
            self._notices.say(
                tr("Going there"), tr("A later wish overtakes this one."), share
            )

    @Slot()
    def _on_arrived(self) -> None:
        if self._is_left() or self._thread is None:
            return
        shown = self._thread.take()
        if shown is None or self._side is None:
            return
        is_first = self._seen is None
        self._seen = shown
        _show(self.picture, shown.here)
        if shown.there is not None:
            _show(self.beside, shown.there)
        self._say_what_is_shown(shown)
        signs = shown.here.signs
        self._bars.show_signs(signs)
        self.picture.point_at(shown.pointer, signs.hazard_text(), hazard_look(signs)[0])
        self._gauges.show_readings(_readings(shown))
        self._side.tasks.show_states(shown.here.tasks)
        self._side.show_tool(shown.here.sample.instrument)
        if shown.tissue_changed and not is_first:
            self._side.slices.refresh()
            self._side.overview.refresh()
        self._is_stale = True
        if shown.jump == self._jump and self._player is not None:
            if self._is_told_to_go:
                self._is_told_to_go = False
                self._notices.say("")
            if self._plays_on:
                self._plays_on = False
                self._player.play()
            self._tell_position()
        self.shown.emit()

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

    @Slot(str, str)
    def _on_told(self, title: str, detail: str) -> None:
        if not self._is_left():
            self._notices.notify(tr(title), tr(detail))

    @Slot(object)
    def _on_head(self, head: HeadModel) -> None:
        if not self._is_left() and self._side is not None:
            self._side.overview.show_head(head)

    @Slot(object)
    def _on_slices(self, views: SliceViews) -> None:
        if not self._is_left() and self._side is not None:
            self._side.slices.show_head(views)
            self._is_stale = True

    @Slot()
    def _on_overview_changed(self) -> None:
        self._is_stale = True

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

    @Slot(str, float)
    def _on_measuring(self, stage: str, share: float) -> None:
        if not self._is_left() and self._side is not None:
            self._side.metrics.say(f"{tr(stage)}: {share:.0%}")
            self._gauges.show_status(
                tr("Measuring the session: {share:.0%}", share=share)
            )

    @Slot(float)
    def _on_near(self, until_s: float) -> None:
        if not self._is_left():
            self.line.show_near(until_s)

    @Slot(object, object)
    def _on_measured(self, marks: list[TimeMark], rows: list[Row]) -> None:
        if self._is_left() or self._side is None or self._opened is None:
            return
        self._marks = [*marks, *(m for m in self._marks if m.kind == "notes")]
        self._show_marks()
        self._side.events.show_marks(marks)
        self._side.metrics.show_rows(rows)
        self._gauges.show_status(tr("F1: all keys"))

    @Slot(str)
    def _on_unmeasured(self, problem: str) -> None:
        if not self._is_left() and self._side is not None:
            self._side.metrics.say(tr("Not measured"), tr(problem))
            self._gauges.show_status("")

    @Slot(object)
    def _on_notes(self, notes: Sequence[Note]) -> None:
        if self._side is None:
            return
        self._side.book.show_notes(notes)
        self._marks = [m for m in self._marks if m.kind != "notes"]
        self._marks += note_marks(notes)
        self._show_marks()

    def _show_marks(self) -> None:
        self.line.show_marks(self._marks)

    @Slot(object)
    def _on_pictured(self, picture: MomentPicture) -> None:
        if not self._is_left() and self._side is not None:
            self._side.moments.show_moment(picture)

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
            case Qt.Key.Key_Space:
                self.play_or_pause()
            case Qt.Key.Key_Left | Qt.Key.Key_Right:
                self._step_key(-1 if key == Qt.Key.Key_Left else 1, is_long)
            case Qt.Key.Key_Up | Qt.Key.Key_Down:
                self.transport.change_speed(1 if key == Qt.Key.Key_Up else -1)
            case Qt.Key.Key_PageUp | Qt.Key.Key_PageDown:
                self.go_to_event(-1 if key == Qt.Key.Key_PageUp else 1)
            case Qt.Key.Key_Home if self._player is not None:
                self.seek(self._player.begin_s)
            case Qt.Key.Key_End if self._player is not None:
                self.seek(self._player.end_s)
            case Qt.Key.Key_Escape if self._is_writing:
                self.setFocus()
            case Qt.Key.Key_Escape if self._is_free:
                self.switch_view()
            case Qt.Key.Key_Escape if self.window().isFullScreen():
                self.full_screen_wanted.emit()
            case Qt.Key.Key_Q | Qt.Key.Key_Escape:
                self.left.emit()
            case Qt.Key.Key_F:
                self.full_screen_wanted.emit()
            case _ if not self._command(key):
                super().keyPressEvent(event)

    def _command(self, key: Qt.Key) -> bool:
        """Obey a key that has nothing to do with time; return whether it was one."""
        side, bar = self._side, self.transport
        match key:
            case Qt.Key.Key_V:
                self.switch_view()
            case Qt.Key.Key_K:
                self.keep_moment()
            case Qt.Key.Key_N:
                self._write_note()
            case Qt.Key.Key_B:
                self._ask_beside()
            case Qt.Key.Key_L if bar.align.isVisible():
                bar.align.setCurrentIndex(1 - bar.align.currentIndex())
                self._take_alignment()
            case Qt.Key.Key_O:
                self._ask_bundle()
            case Qt.Key.Key_M if side is not None:
                self._notices.notify(side.slices.switch(), "")
            case Qt.Key.Key_C if side is not None:
                self._notices.notify(side.overview.switch(), "")
            case Qt.Key.Key_F1 if side is not None:
                side.show_keys()
            case Qt.Key.Key_I if side is not None:
                side.tasks.switch_hint()
            case _:
                return False
        return True

    @property
    def _is_writing(self) -> bool:
        return self._side is not None and self._side.book.line.hasFocus()

    def _step_key(self, step: int, is_long: bool) -> None:
        if is_long and self._player is not None:
            self.seek(self._player.position_s + LONG_STEP_S * step)
        else:
            self.step(step)

    def catch_up(self) -> None:
        """Draw the overview now."""
        self._draw_overview()
        if self._side is not None:
            self._side.overview.finish()

    def release(self) -> list[threading.Thread]:
        """End the replay; free the overview's graphics memory."""
        self._timer.stop()
        for thread in (self._opening, self._thread):
            if thread is not None:
                self._endings.append(thread.leave())
        if self._side is not None:
            self._side.overview.release()
        return self._endings


def bundle_of(path: Path) -> Path:
    """Return the bundle that a path means: itself, or the one that a file is of."""
    return path.parent if path.is_file() and path.parent.suffix else path


def _show(picture: PictureView, moment: ShownMoment) -> None:
    """Show a moment's picture, with the sides of the patient round it."""
    _, right, up, forward = moment.view.camera.frame
    picture.mark_sides(side_letters(right, up), looks_towards(forward))
    picture.show_picture(moment.frame.pixels)


def _readings(shown: ShownReplay) -> Readings:
    view = shown.here.view
    return Readings(
        clearance_mm=view.clearance_mm,
        time_s=shown.here.sample.time_s,
        hazard=view.hazard,
        has_hazards=view.hazard is not None,
        drags_mm=view.drags_mm,
    )
