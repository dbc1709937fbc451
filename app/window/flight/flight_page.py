"""The page of a flight: the endoscope's picture large, the overview at its side."""

import math
import time
from collections.abc import Mapping
from functools import partial
from threading import Thread

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, Qt, Signal, Slot
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from app.window.flight.aid_keys import AidKeys
from app.window.flight.flight_actions import FlightActions
from app.window.flight.flight_thread import (
    DisplayedFrame,
    FlightThread,
    HeadUnseen,
    ScopeLaid,
    SoundFailed,
    ThreadEnding,
    WindowEvent,
)
from app.window.flight.help_overlay import HelpOverlay
from app.window.flight.keys import HandEvents
from app.window.flight.large_view import LargeView
from app.window.flight.scope_screen import ScopeScreen
from app.window.flight.side_panel import SideColumn
from app.window.flight.tool_keys import ToolKeys
from app.window.flight.view_keys import ScopeKeys, SoundKeys, slice_commands
from app.window.keyboard.actions import GESTURES, STEERING, Act, Group, rows
from app.window.keyboard.key_map import KEYS
from app.window.keyboard.page_commands import Command, Commands
from app.window.scaling import lay
from app.window.session_page import SessionPage, with_patient
from app.window.session_thread import FrameReady, HeadModelled, SlicesReady
from app.window.texts import later, tr
from paravol.feedback import NO_SIGNS, TouchSigns
from paravol.feedback.shaft_heading import place_in_picture, shaft_heading
from paravol.feedback.taken_text import bite_text, taken_text, takes_tissue
from paravol.flight import flight_events as events
from paravol.flight.flight_events import FlightEnd
from paravol.scoring.readings import Readings
from paravol.snapshots.snapshot_queue import MomentPicture
from scenarios import FrameState
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments.contact_shape import works_at_mm
from scenarios.tasks import Status, TaskEvent

AHEAD_MM = 14.0
"""How far before the eye a place moves that tells whether the scope has turned."""

OVERVIEW_MS = 100
"""Shortest time between two pictures of the overview."""

OVERVIEW_SHARE = 0.08
"""Largest part of the time for drawing the overview, where OpenGL is software. Of a
picture of 900 x 560 pixels 23 ms of a busy machine's processors were measured, 6 of
them in the thread that asks: the rest is OpenGL's own threads'."""

LATE_OVERVIEW_SHARE = 0.04
"""As much where frames are late: the overview gives way to the scope's picture."""

BARS_S = 0.06
"""Shortest time between two paintings of the bars, unless a word of theirs changes:
nobody reads figures sooner."""

SEEN_MM = 0.1
"""What moves less is where it was in the overview: a third of a pixel."""

INJURY_S = 5.0
"""So long an injury rings the picture."""

ROLL_STEP_DEG = 5.0
ASKED = later("End this flight?")
FROZEN = later("Frozen")
HELP, COVERED, BLIND = "the keys are shown", "a dialog is open", "nothing is seen yet"
"""Why the clock stands, beside `FROZEN`."""

BEGINS_S = 30.0
"""So long after the first picture the clock runs, with an overview or without."""


class FlightPage(SessionPage):
    """Show a flight, from its preparation to its result."""

    _side: SideColumn

    first_shown = Signal()
    """The first picture is there."""
    guide_switched = Signal(bool)
    """The way to the task's place is shown, or no longer."""

    begun = Signal()
    """The overview shows the head, too: whoever flies can see, and the clock runs."""

    def __init__(self, thread: FlightThread, *, edge_samples: int) -> None:
        """Lay out the page and listen to the flight.

        edge_samples: samples a pixel for smooth edges in the overview.
        """
        super().__init__(OVERVIEW_MS)
        self._thread = thread
        self._flight = thread.flight
        self._order = order = thread.flight.order
        self._frame: DisplayedFrame | None = None
        self._registration_mm: float | None = None
        self._is_away = False
        self._stands: set[str] = set()
        """Why the clock stands; empty where it runs."""
        self._has_begun = self._draws_head = False
        self._begins_by_s = math.inf
        self._is_under_way = False
        self._may_leave = False
        self.title = f"PARAVOL: {with_patient(order.scenario)}"
        self._side = SideColumn(order, edge_samples)
        self._take_side(self._side)
        self._overview, self._slices = self._side.overview, self._side.slices
        self._moments = self._side.moments
        self._screen: ScopeScreen | None = None
        self._hand: HandEvents | None = None
        controls = order.input.controls
        if order.instrument is not None and order.instrument.controls is not None:
            controls = order.instrument.controls
        if controls is not None:
            self._hand = HandEvents(
                controls, self.picture, lambda: self._flight.hand.is_pointing
            )
        told = self._notices.notify
        self._tools: ToolKeys | None = None
        if not order.has_own_tool:
            self._tools = ToolKeys(
                self._flight.hand,
                self.picture,
                told,
                is_steered=order.input.controls is not None,
            )
        self._sound = SoundKeys(thread.sound, told)
        self._aids = AidKeys(thread, self.picture, told, self.guide_switched.emit)
        scopes = ScopeKeys(self._flight.scope, told)
        self._commands = {
            **self._own_commands(),
            **scopes.commands(),
            **self._sound.commands(),
            **self._aids.commands(),
            **slice_commands(self._slices, told),
            **({} if self._tools is None else self._tools.commands()),
            **({} if self._hand is None else self._hand.commands()),
        }
        self._held: set[Act] = set()
        self._actions = FlightActions(
            self._commands,
            scopes,
            self._tools,
            self._sound,
            is_steered=controls is not None,
        )
        self._large = LargeView(self._lay_out(), self.picture, self._side)
        self._help = HelpOverlay(self, self._all_keys)
        self._help.switched.connect(partial(self.stand, HELP))
        # what was recorded goes on by itself, and counts from its first pose
        self.stand(BLIND, math.isinf(order.input.until_s))
        self._injury = ""
        self._injured_until_s = 0.0
        self._stuck = ""
        self._taken_mm3: Mapping[str, float] = {}
        self._has_worked = False
        # not before anything is flown or touched: its libraries take a second
        self._overview_due_s = math.inf
        self._overview_shows: FrameState | None = None
        self._bars_due_s = 0.0
        thread.told.connect(self._hear)
        self._hear(events.Progressed("Starting", 0.0))

    def _lay_out(self) -> QVBoxLayout:
        middle = QWidget()
        row = lay(QHBoxLayout(middle), 0, gap=0)
        row.addWidget(self._actions.bar)
        column = lay(QVBoxLayout(), 0, gap=0)
        column.addWidget(self.picture, 1)
        column.addWidget(self._bars)
        row.addLayout(column, 5)
        row.addWidget(self._side, 3)
        rows = lay(QVBoxLayout(self), 0, gap=0)
        rows.addWidget(middle, 1)
        rows.addWidget(self._gauges)
        return column

    def switch_help(self) -> None:
        """Show all keys, or hide them."""
        self._help.switch()

    def _all_keys(self) -> dict[str, list[tuple[str, str]]]:
        """Return the keys of this flight by what they are for."""
        order, hidden = self._order, set[Act]()
        if self._hand is None:
            hidden |= STEERING - {Act.TURN_LEFT, Act.TURN_RIGHT}
        if not order.scenario.tasks:
            hidden |= {Act.FREEZE, Act.HINT, Act.GUIDE}
        if not order.input.can_lay:
            hidden.add(Act.ASSIST)
        groups = {group: rows(group, KEYS.label, hidden) for group in Group}
        groups[Group.SLICES] += GESTURES[Group.SLICES]
        if self._hand is not None:
            groups[Group.SCOPE] += GESTURES[Group.SCOPE]
        for device in (order.input, order.instrument):
            groups[Group.SCOPE] += [] if device is None else device.keys.items()
        groups[Group.TOOL] += GESTURES[Group.TOOL]
        if order.has_own_tool:
            groups[Group.TOOL] = []
        return {group.value: told for group, told in groups.items()}

    def _switch_large(self) -> None:
        """Make the next view large: the scope's picture, slices or the overview."""
        self._notices.notify(
            tr(self._large.next()),
            tr("{key} makes the next view large.", key=KEYS.label(Act.LARGE)),
        )

    def _switch_second_screen(self) -> None:
        """Show the scope's picture on another screen, or take it away."""
        if self._screen is not None:
            self._screen.close()
            return
        self._screen = ScopeScreen(self.picture, self)
        self._screen.closed.connect(self._on_screen_closed)
        for listener in (self._hand, self._tools):
            if listener is not None:
                self._screen.installEventFilter(listener)
        self._notices.notify(
            self._screen.fill(),
            tr(
                "{key} or Esc there closes it.",
                key=KEYS.label(Act.SECOND_SCREEN),
            ),
        )

    @Slot()
    def _on_screen_closed(self) -> None:
        self._screen = None

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Obey a key."""
        match event.key():
            case Qt.Key.Key_Return | Qt.Key.Key_Enter if self._notices.is_asking:
                self._end_flight()
            case Qt.Key.Key_Escape if self._notices.is_asking:
                self._notices.answered()
            case Qt.Key.Key_Escape if not self._help.isHidden():
                self._help.switch()
            case Qt.Key.Key_Escape if self.window().isFullScreen():
                self.full_screen_wanted.emit()
            case Qt.Key.Key_Escape:
                self._ask_to_leave()
            case _:
                self._obey(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Let go of what counts while its key is held."""
        act = KEYS.action(event)
        if act not in self._commands:
            super().keyReleaseEvent(event)
        elif not event.isAutoRepeat():
            self._let_go(act)

    def event(self, event: QEvent) -> bool:
        """Let go of all keys as the window loses them: they are lifted unseen."""
        if event.type() == QEvent.Type.WindowDeactivate:
            for act in tuple(self._held):
                self._let_go(act)
        return super().event(event)

    def _obey(self, event: QKeyEvent) -> None:
        act = KEYS.action(event)
        if act not in self._commands:
            super().keyPressEvent(event)
            return
        command = self._commands[act]
        if command.repeats or not event.isAutoRepeat():
            self._held.add(act)
            command.press()

    def _let_go(self, act: Act) -> None:
        self._held.discard(act)
        release = self._commands[act].release
        if release is not None:
            release()

    def _own_commands(self) -> Commands:
        """Return what can be done with the page; the hand's steering goes before."""
        flight = self._flight

        def turn_post(by_deg: float) -> Command:
            def press() -> None:
                flight.scope.post_deg += by_deg

            return Command(press, repeats=True)

        def turn_camera(by_deg: float) -> Command:
            def press() -> None:
                flight.scope.camera_deg += by_deg

            return Command(press, repeats=True)

        left, right = turn_post(-ROLL_STEP_DEG), turn_post(ROLL_STEP_DEG)
        commands = {
            Act.END: Command(self._ask_to_leave),
            Act.FULL_SCREEN: Command(self.full_screen_wanted.emit),
            **dict.fromkeys((Act.TURN_LEFT, Act.TILT_LEFT, Act.TILT_DOWN), left),
            **dict.fromkeys((Act.TURN_RIGHT, Act.TILT_RIGHT, Act.TILT_UP), right),
            Act.HEAD_LEFT: turn_camera(-ROLL_STEP_DEG),
            Act.HEAD_RIGHT: turn_camera(ROLL_STEP_DEG),
            Act.SCOPE_OUT: Command(self._order.input.go_out),
            Act.HELP: Command(self.switch_help),
            Act.LARGE: Command(self._switch_large),
            Act.SECOND_SCREEN: Command(self._switch_second_screen),
            Act.OPEN_HEAD: Command(self._open_head),
            Act.MOMENT: Command(self._keep_moment),
            Act.ENLARGE: Command(self._enlarge),
            Act.KEEP_VIEW: Command(self._keep_view),
        }
        if self._order.scenario.tasks:
            commands[Act.FREEZE] = Command(self._freeze)
            commands[Act.HINT] = Command(self._side.tasks.switch_hint)
        return commands

    def _open_head(self) -> None:
        self._notices.notify(self._overview.switch(), tr("The side wall of the nose"))

    def _enlarge(self) -> None:
        if self._moments.times_s:
            self._moments.enlarge(self._moments.times_s[0])

    def _keep_view(self) -> None:
        if self._frame is not None:
            self._flight.keep_view()

    def _ask_to_leave(self) -> None:
        if self.may_leave():
            self.left.emit()

    def may_leave(self) -> bool:
        """Ask while a flight is under way.

        Leaving a second time is an answer, too: a mouse has no other.
        """
        if not self._is_under_way or self._may_leave or self._notices.is_asking:
            return True
        self._notices.ask(tr(ASKED), tr("Enter ends it · Esc flies on"))
        return False

    def _leave(self) -> None:
        """Leave without asking."""
        self._may_leave = True
        self.left.emit()

    def _end_flight(self) -> None:
        """End the flight and show its result, or leave where none has begun."""
        self._notices.answered()
        if self._frame is None:
            self._leave()
        self._flight.end()

    def release(self) -> list[Thread]:
        """End the flight and free the overview's graphics memory.

        It is not waited for: whoever started its thread does so.
        """
        self._flight.cancel()
        if self._screen is not None:
            self._screen.close()
        return super().release()

    def _keep_moment(self) -> None:
        if self._flight.result is not None or self._frame is None:
            return
        if self._flight.recording.folder is None:
            self._notices.notify(
                tr("This flight is not recorded"), tr("So no moment can be kept.")
            )
        else:
            self._flight.keep_moment()

    @property
    def has_tools(self) -> bool:
        """Return whether the second hand is the window's."""
        return self._tools is not None

    def stand(self, why: str, is_on: bool) -> None:
        """Let the clock stand for a reason, or no longer; nothing counts meanwhile.

        It runs when no reason is left.
        """
        if is_on:
            self._stands.add(why)
        else:
            self._stands.discard(why)
        self._flight.hand.freeze(bool(self._stands))

    def covered(self, is_on: bool) -> None:
        """Let the clock stand while a dialog is open."""
        self.stand(COVERED, is_on)

    def _freeze(self) -> None:
        """Freeze the trainer, or let it go on."""
        self.stand(FROZEN, FROZEN not in self._stands)
        if FROZEN in self._stands:
            key = KEYS.label(Act.FREEZE)
            self._notices.say(
                tr(FROZEN),
                tr("The clock stands and nothing counts; {key} goes on.", key=key),
            )
        else:
            self._notices.say("")

    @Slot(object)
    def _hear(self, event: WindowEvent) -> None:
        """Show what happens."""
        notify = self._notices.notify
        match event:
            case FrameReady():
                self._show_frame()
            case events.Progressed(stage, share):
                how = tr("This is quick once it was done before.")
                self._notices.say(tr(stage), how, share)
            case SlicesReady(views):
                self._slices.show_head(views)
            case HeadModelled(model):
                self._overview.show_head(model)
            case HeadUnseen(why):
                self._overview.tell(tr(why))
                self._begin()
            case events.Touching(_, share):
                self._ask_to_touch(share)
            case events.RecordingBegan(residual_mm):
                self._begin_flight(residual_mm)
            case events.MomentKept(frame):
                notify(
                    tr("Kept the moment at {time_s:.1f} s", time_s=frame.sample.time_s),
                    tr("It is being drawn at high quality, beside the flight."),
                )
            case MomentPicture():
                self._moments.show_moment(event)
            case events.ViewSaved(said, where):
                notify(tr(said), tr(where))
            case events.Injured(text):
                self._tell_injury(text)
            case TaskEvent(status=Status.DONE):
                notify(tr("Done"), tr(event.text))
            case TaskEvent(status=Status.FAILED):
                notify(tr("Failed: {name}", name=tr(event.task)), tr(event.text))
            case SoundFailed(why):
                self._sound.fail(why)
            case ScopeLaid(is_found, other):
                self._aids.tell_laid(is_found, other)
            case events.ToolDeviceNews(text):
                notify(tr("The tool's device"), tr(text))
            case events.StoodStill(text):
                notify(tr("The flight stood still"), tr(text))
            case events.RecordingStopped(why):
                notify(tr("Nothing more is recorded"), tr(why))
            case events.DeviceLost():
                self._wait_for_device()
            case events.DeviceBack(away_s):
                self._go_on(away_s)
            case FlightEnd():
                self._show_end(event)
            case ThreadEnding():
                self._is_under_way = False
                if self._thread.error is not None:
                    self._leave()

    def _begin(self) -> None:
        """Let the clock run: there is all to see that there will be."""
        if self._has_begun:
            return
        self._has_begun = True
        if BLIND in self._stands:
            self.stand(BLIND, False)
            self._notices.notify(
                tr("The clock runs"),
                tr("Fly with {name}", name=tr(self._order.input.name)),
            )
        self.begun.emit()

    def _ask_to_touch(self, share: float) -> None:
        """Ask for the next fiducial; share: of them that were touched."""
        if not self._is_under_way:
            self._overview_due_s = 0.0
        self._is_under_way = True
        fiducials = self._order.scenario.fiducials
        touched = round(share * len(fiducials))
        positions = self._order.scenario.fiducial_positions()
        if touched < len(fiducials):
            how = self._order.input.touch_hint
            name = fiducials[touched].name
            self._notices.say(
                tr(
                    "Touch the {name} ({number} of {count})",
                    name=tr(name),
                    number=touched + 1,
                    count=len(fiducials),
                ),
                tr(how),
                touched / len(fiducials),
            )
        self._overview.show_fiducials(positions, touched)

    def _begin_flight(self, residual_mm: float | None) -> None:
        self._registration_mm = residual_mm
        self._is_under_way = True
        # what was prepared is done
        self._notices.say("")
        if residual_mm is None:
            self._notices.notify(
                tr("Ready"), tr("Fly with {name}.", name=tr(self._order.input.name))
            )
        else:
            fiducials = self._order.scenario.fiducial_positions()
            self._overview.hide_fiducials(fiducials)
            self._notices.notify(
                tr("Registered"),
                tr(
                    "The touched points fit to {residual_mm:.2f} mm rms.",
                    residual_mm=residual_mm,
                ),
            )
        self.picture.mark_recording(self._flight.recording.folder is not None)

    def _show_frame(self) -> None:
        frame = self._thread.take()
        if frame is None:
            return
        before, self._frame = self._frame, frame
        if before is None:
            self._overview_due_s = 0.0
            self._begins_by_s = time.monotonic() + BEGINS_S
            if BLIND in self._stands:
                self._notices.say(
                    tr("Look around"), tr("The clock starts with the overview.")
                )
            self.first_shown.emit()
        if frame.cuts != (0 if before is None else before.cuts):
            self._side.refresh()
        self._show_signs(NO_SIGNS if before is None else before.signs)
        self._tell_taken(frame)
        self._warn()
        view = frame.view
        works, would_take = None, ""
        if view.instrument != NO_TOOL:
            tool = view.world_from_instrument
            works = tool[:3, :3] @ works_at_mm(view.instrument) + tool[:3, 3]
        if self._thread.guide.is_on and not frame.tool.is_working:
            would_take = tr(bite_text(frame.signs.bite_mm3))
        self.picture.mark_tip(place_in_picture(view.camera, works), would_take)
        self.picture.mark_heading(shaft_heading(view.camera, view.world_from_tip))
        self._aids.follow()
        self.picture.guide_to(frame.guide, frame.names)
        self._show_view(self.picture, view, frame.pixels)

    def _show_signs(self, before: TouchSigns) -> None:
        """Show force and nearness; say what broke since the signs before."""
        frame = self._frame
        signs = NO_SIGNS if frame is None or self._is_away else frame.signs
        now_s = time.monotonic()
        has_news = (signs.breaks, signs.bites, signs.strain, signs.is_near_hazard) != (
            (before.breaks, before.bites, before.strain, before.is_near_hazard)
        )
        if now_s >= self._bars_due_s or has_news:
            self._bars_due_s = now_s + BARS_S
            self._bars.show_signs(signs, self._sound.caption)
        pointer = frame.pointer if frame is not None and not self._is_away else None
        self._point_at(pointer, signs)
        if signs.breaks > before.breaks:
            self._notices.notify(*map(tr, signs.break_text()))

    def _tell_taken(self, frame: DisplayedFrame) -> None:
        """Say what a tool took, when its pedal is let go."""
        if not frame.tool.is_working:
            # what is pressed may have taken tissue by the first frame
            before, self._taken_mm3 = self._taken_mm3, frame.signs.taken_mm3
            if self._has_worked and takes_tissue(frame.tool.name):
                self._notices.notify(
                    tr(taken_text(before, frame.signs.taken_mm3)),
                    tr(frame.tool.name.capitalize()),
                )
        self._has_worked = frame.tool.is_working

    def _tell_stuck(self) -> None:
        """Say once that scope or tool cannot go on, and the way out."""
        stuck = ""
        if self._order.input.is_wedged:
            stuck = "scope"
        elif self._flight.hand.is_stuck:
            stuck = "tool"
        was, self._stuck = self._stuck, stuck
        if not stuck or stuck == was or self._frame is None:
            return
        if stuck == "scope":
            touched = tr(self._frame.view.touched or "the nostril")
            self._notices.notify(
                tr("Stuck at {touched}", touched=touched),
                tr(
                    "Draw back: {back} or the wheel. {out} takes the scope outside.",
                    back=KEYS.label(Act.MOVE_OUT),
                    out=KEYS.label(Act.SCOPE_OUT),
                ),
            )
        else:
            touched = tr(self._frame.view.tool_touched or "the scope")
            self._notices.notify(
                tr("The tool does not get there: {touched}", touched=touched),
                tr("Point elsewhere, or make room: move the scope aside or back."),
            )

    def _tell_injury(self, text: str) -> None:
        what, how = (tr(part) for part in text.split(": ", 1))
        self._injury = tr("injury: {what}", what=what)
        self._injured_until_s = time.monotonic() + INJURY_S
        self._notices.notify(tr("Injury: {what}", what=what), how)
        self._warn()

    def _wait_for_device(self) -> None:
        """Leave the picture as it is and say that it is not live."""
        self._is_away = True
        self._warn()
        self._notices.say(
            tr("The device is away"),
            tr(
                "{name}: check plugs and power; the session goes on by itself.",
                name=tr(self._order.input.name),
            ),
        )

    def _go_on(self, away_s: float) -> None:
        self._is_away = False
        self._warn()
        self._notices.notify(
            tr("The device is back"),
            tr("It was away for {away_s:.1f} s.", away_s=away_s),
        )

    def _show_end(self, end: FlightEnd) -> None:
        self._is_under_way = False
        self._notices.answered()
        self.picture.mark_recording(False)
        self.picture.warn("")
        self.picture.show_result(end)

    def _warn(self) -> None:
        """Ring the picture when something is hurt or pressed, or it is not live.

        What it merely touches is only named.
        """
        frame, pressed = self._frame, ""
        touched = "" if frame is None else tr(frame.view.touched)
        if frame is not None and not touched and frame.view.tool_touched:
            touched = tr("{touched} (tool)", touched=tr(frame.view.tool_touched))
        if self._readings().is_pressing:
            pressed = tr("pressing: {touched}", touched=touched)
        if time.monotonic() < self._injured_until_s:
            pressed = self._injury
        if frame is not None and frame.is_frozen and BLIND not in self._stands:
            pressed = tr("frozen")
        self.picture.warn(tr("not live") if self._is_away else pressed, touched)

    def _readings(self) -> Readings:
        frame = self._frame
        if frame is None:
            return Readings(registration_mm=self._registration_mm)
        return Readings(
            None if self._is_away else frame.fps,
            None if self._is_away else frame.pose_age_ms,
            frame.view.clearance_mm,
            frame.time_s - frame.stood_s,
            self._registration_mm,
            frame.view.hazard,
            frame.view.hazard is not None,
            frame.view.drags_mm,
        )

    @Slot()
    def _tick(self) -> None:
        """Bring up to date what need not change with every frame."""
        readings = self._readings()
        self._gauges.show_readings(readings)
        is_recording = self._flight.recording.folder is not None
        picture = self._flight.picture
        if picture is not None:
            # not with every step of a drag at the window's edge
            picture.want(self._wanted_px())
        self._gauges.show_status(
            tr(
                readings.status(
                    is_recording=is_recording,
                    picture="" if picture is None else picture.told,
                )
            )
        )
        self._show_signs(self._frame.signs if self._frame else NO_SIGNS)
        if self._frame is not None:
            self._side.show_tool(self._frame.tool)
            guide = self._frame.guide
            self._side.tasks.show_states(self._frame.tasks)
            self._side.tasks.show_way(guide, is_on=self._aids.has_guide)
            self._actions.show_frame(
                self._frame,
                has_hint=self._side.tasks.has_hint,
                has_guide=self._aids.has_guide,
            )
            view, tool = self._frame.view, None
            if view.instrument != NO_TOOL:
                tool = view.world_from_instrument[:3, 3]
            goal = None if guide is None else guide.place_mm
            self._slices.follow(view.world_from_tip[:3, 3], tool, goal)
        self._tell_stuck()
        if time.monotonic() >= self._begins_by_s:
            self._begin()
        self._is_stale = self._is_stale or self._has_moved()
        super()._tick()

    def _wanted_px(self) -> int:
        """Return the edge of the scope's picture where it is largest, in pixels."""
        if self._screen is None:
            return self.picture.edge_px
        return max(self.picture.edge_px, self._screen.edge_px)

    def _draw_overview(self) -> None:
        """Have it drawn, and not again before it is and the budget allows."""
        self._is_stale = False
        self._overview_due_s = math.inf
        self._overview_shows = None if self._frame is None else self._frame.view
        self._draws_head = self._frame is not None and self._overview.has_head
        self._overview.draw(self._overview_shows)

    def _has_moved(self) -> bool:
        """Return whether the overview shows the tools elsewhere than they are."""
        if self._frame is None:
            return False
        now, then = self._frame.view, self._overview_shows
        if then is None or (now.instrument, now.jaw) != (then.instrument, then.jaw):
            return True
        return not np.allclose(
            _shown_places(now), _shown_places(then), 0.0, SEEN_MM, equal_nan=True
        )

    @Slot(float)
    def _on_overview_drawn(self, took_s: float) -> None:
        if self._draws_head:
            self._begin()
        picture = self._flight.picture
        is_late = picture is not None and picture.is_late
        share = LATE_OVERVIEW_SHARE if is_late else OVERVIEW_SHARE
        self._overview_due_s = time.monotonic() + took_s / share


_OF_A_TOOL = np.array(
    [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 100.0, 1.0], [10.0, 0.0, 0.0, 1.0]]
).T
"""Places of a tool that tell where it is: its tip, its shaft, its side; its frame."""


def _shown_places(view: FrameState) -> NDArray[np.float64]:
    """Return places ``(3, 7)``, mm LPS, that tell where the overview shows what."""
    eye, _, _, forward = view.camera.frame
    tools = (view.world_from_tip, view.world_from_instrument)
    places = [tool[:3] @ _OF_A_TOOL for tool in tools]
    return np.column_stack([*places, eye + AHEAD_MM * forward])
