"""Somebody who understands nothing: random keys, clicks, drags and wheel in the window.

A program of its own, run by `test_monkey.py`: it starts `paravol train` and hits what
is in the window, as the window system would, for so many seconds by a seed. A JSON
object on the last line of its standard output tells what came of it; a file keeps what
was done.

What the machine's other work costs is taken off a stall: how long the threads of this
process, and a bare one beside it, waited for a processor meanwhile.
"""

import faulthandler
import json
import random
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QPoint, QRect, Qt, QTimer
from PySide6.QtGui import QGuiApplication, QWindow
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QFileDialog, QMenu, QWidget
from shiboken6 import getCppPointer, isValid

Key, Modifier, Button = Qt.Key, Qt.KeyboardModifier, Qt.MouseButton

STALL_S = 0.5
"""So long nothing may answer."""

LOOK_S = 0.02
"""Between two looks whether the window answers."""

PLAIN = [
    Key(value)
    for value in range(Key.Key_Space, Key.Key_AsciiTilde + 1)
    if not chr(value).islower()
]
SPECIAL = [
    *(Key(value) for value in range(Key.Key_F1, Key.Key_F12 + 1)),
    *(Key.Key_Escape, Key.Key_Return, Key.Key_Enter, Key.Key_Tab, Key.Key_Backtab),
    *(Key.Key_Backspace, Key.Key_Delete, Key.Key_Insert, Key.Key_Menu, Key.Key_Help),
    *(Key.Key_Left, Key.Key_Right, Key.Key_Up, Key.Key_Down, Key.Key_PageUp),
    *(Key.Key_PageDown, Key.Key_Home, Key.Key_End, Key.Key_Space),
    *(Key.Key_Shift, Key.Key_Control, Key.Key_Alt, Key.Key_CapsLock),
    *(Key.Key_Odiaeresis, Key.Key_ssharp, Key.Key_MediaPlay, Key.Key_VolumeUp),
]
LETTERS_OF_USE = [
    Key(ord(letter)) for letter in "WASDQEHTBPNIOMLRGFVUCXZ1234567890+-"
] + [Key.Key_Return, Key.Key_Escape, Key.Key_Space]
MODIFIERS = [
    *[Modifier.NoModifier] * 12,
    *(Modifier.ShiftModifier, Modifier.ControlModifier, Modifier.AltModifier),
    *(Modifier.MetaModifier, Modifier.KeypadModifier),
    Modifier.ControlModifier | Modifier.ShiftModifier,
]
BUTTONS = [*[Button.LeftButton] * 6, Button.RightButton, Button.MiddleButton]


class Waits(threading.Thread):
    """Sum up how much longer than asked for a process beside sleeps, and when."""

    SLEEPER = (
        "import os, signal, time\n"
        "signal.signal(signal.SIGPIPE, signal.SIG_DFL)\n"
        "while True:\n"
        "    before = time.monotonic()\n"
        "    time.sleep(0.01)\n"
        "    late = time.monotonic() - before - 0.01\n"
        "    if late > 0.005: os.write(1, f'{before} {late}\\n'.encode())\n"
    )

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.child = subprocess.Popen(
            [sys.executable, "-c", self.SLEEPER], stdout=subprocess.PIPE, text=True
        )
        self.seen: list[tuple[float, float]] = []

    def run(self) -> None:
        assert self.child.stdout is not None
        for line in self.child.stdout:
            before, late = map(float, line.split())
            self.seen.append((before, late))

    def between(self, begin_s: float, end_s: float) -> float:
        """Return the seconds that it came late between two times."""
        return sum(late for at, late in self.seen if begin_s - late < at < end_s)


def queued_s() -> dict[str, float]:
    """Return how long each thread of this process has waited for a processor, s."""
    found = {}
    for task in Path("/proc/self/task").glob("*"):
        try:
            ran, waited, _ = (task / "schedstat").read_text().split()
        except (OSError, ValueError):
            continue
        found[task.name] = float(waited) * 1e-9
        del ran
    return found


def number_of(handle: QWindow) -> int:
    """Return what tells a window from all others."""
    return int(getCppPointer(handle)[0])


def is_there(number: int) -> bool:
    """Return whether a window is there still: a menu goes when it is hit."""
    return number in map(number_of, QGuiApplication.allWindows())


def inside(handle: QWindow, at: QPoint) -> QPoint:
    """Return the place of a window nearest to one: it may have become smaller."""
    size = handle.size()
    x, y = min(at.x(), size.width() - 1), min(at.y(), size.height() - 1)
    return QPoint(max(x, 0), max(y, 0))


class Monkey(QObject):
    """Hit something again and again, until time is up; watch whether it is heard."""

    def __init__(self, seed: int, seconds: float, log: Path) -> None:
        super().__init__()
        self.random = random.Random(seed)
        self.log = log.open("w")
        self.traces = log.with_suffix(".traces").open("w+")
        self.begun_s = self.last_s = time.monotonic()
        self.until_s = self.begun_s + seconds
        self.events = 0
        self.pages: Counter[str] = Counter()
        self.stalls: list[dict[str, Any]] = []
        self.closings = 0
        self.flights: list[str] = []
        self.queued = queued_s()
        self.waits = Waits()
        self.waits.start()
        self.held: Qt.Key | None = None
        self.where = QPoint(0, 0)
        self._looks = QTimer(self)
        self._looks.setTimerType(Qt.TimerType.PreciseTimer)
        self._looks.timeout.connect(self.look)
        # once the first page is drawn
        QTimer.singleShot(1500, self.begin)

    def begin(self) -> None:
        """Look and hit from now on."""
        self.last_s = time.monotonic()
        self._looks.start(round(1e3 * LOOK_S))
        self.later()

    # -- watching ----------------------------------------------------------------

    def look(self) -> None:
        """Measure how long nothing was answered."""
        now_s = time.monotonic()
        gap_s = now_s - self.last_s
        if gap_s > STALL_S:
            queued = queued_s()
            waited = {
                name: queued[name] - self.queued.get(name, 0.0) for name in queued
            }
            longest = max(waited.values(), default=0.0)
            beside = self.waits.between(self.last_s, now_s)
            self.traces.flush()
            self.traces.seek(0)
            trace = self.traces.read()
            self.stalls.append(
                {
                    "at_s": round(self.last_s - self.begun_s, 2),
                    "gap_s": round(gap_s, 3),
                    "queued_s": round(longest, 3),
                    "beside_s": round(beside, 3),
                    "own_s": round(gap_s - max(longest, beside), 3),
                    "after": self.events,
                    "page": self.page_name(),
                    "trace": trace[:6000],
                }
            )
        self.traces.seek(0)
        self.traces.truncate()
        self.queued = queued_s()
        self.last_s = time.monotonic()
        faulthandler.dump_traceback_later(STALL_S, file=self.traces)

    def window(self) -> QWidget | None:
        """Return what a person could hit now: a menu, a dialog, or the window."""
        for widget in (
            QApplication.activePopupWidget(),
            QApplication.activeModalWidget(),
        ):
            if widget is not None and widget.isVisible():
                return widget
        shown = [w for w in QApplication.topLevelWidgets() if w.isVisible()]
        shown = [w for w in shown if w.isWindow() and w.windowHandle() is not None]
        return max(shown, key=lambda w: w.width() * w.height(), default=None)

    def page_name(self) -> str:
        """Return the name of the page that is shown."""
        for widget in QApplication.topLevelWidgets():
            page = getattr(widget, "page", None)
            if isinstance(page, QWidget):
                return type(page).__name__
        return "none"

    def note(self, what: str) -> None:
        """Keep what is done, before it is done."""
        self.events += 1
        at_s = time.monotonic() - self.begun_s
        self.log.write(f"{self.events:6d} {at_s:8.2f} {self.page_name():16} {what}\n")
        self.log.flush()

    # -- hitting -----------------------------------------------------------------

    def later(self, wait_ms: int | None = None) -> None:
        """Go on after a while; a timer of its own each, which nested loops serve."""
        if wait_ms is None:
            wait_ms = self.random.choice([10, 20, 30, 60, 120, 250])
        QTimer.singleShot(wait_ms, self.act)

    def act(self) -> None:
        """Do one thing."""
        if time.monotonic() > self.until_s:
            self.end()
            return
        window = self.window()
        self.pages[self.page_name()] += 1
        self.later()
        if window is None:
            return
        if isinstance(window, QFileDialog):
            # it can remove files of this machine
            self.note("escape from a file dialog")
            QTest.keyClick(window, Key.Key_Escape)
            return
        kinds = [self.key] * 6 + [self.useful_key] * 4 + [self.hold] * 2
        kinds += [self.click] * 3 + [self.press_button] * 3 + [self.drag] * 2
        kinds += [self.wheel] * 2 + [self.resize] * (self.random.random() < 0.15)
        self.random.choice(kinds)(window)

    def _key(self, window: QWidget, key: Qt.Key, mask: Qt.KeyboardModifier) -> None:
        is_quit = key in (Key.Key_Q, Key.Key_W, Key.Key_F4)
        if is_quit and mask & (Modifier.ControlModifier | Modifier.AltModifier):
            return
        self.note(f"key {key.name} {mask.name or mask}")
        handle = window.windowHandle()
        number = number_of(handle)
        if mask & Modifier.AltModifier and isinstance(window, QMenu):
            # Alt alone closes a menu. Qt's test would send the key to it all the same,
            # and crash; a keyboard sends it to the window behind.
            key, mask = Key.Key_Alt, Modifier.NoModifier
        QTest.keyPress(handle, key, mask)
        if is_there(number):
            QTest.keyRelease(handle, key, mask)

    def key(self, window: QWidget) -> None:
        """Press any key of the keyboard, with any modifier."""
        keys = PLAIN if self.random.random() < 0.6 else SPECIAL
        self._key(window, self.random.choice(keys), self.random.choice(MODIFIERS))

    def useful_key(self, window: QWidget) -> None:
        """Press a key that something may listen to."""
        self._key(window, self.random.choice(LETTERS_OF_USE), Modifier.NoModifier)

    def hold(self, window: QWidget) -> None:
        """Press a key for a while, or let it go."""
        if self.held is not None:
            self.note(f"release {self.held.name}")
            QTest.keyRelease(window.windowHandle(), self.held)
            self.held = None
            return
        self.held = self.random.choice(LETTERS_OF_USE)
        self.note(f"hold {self.held.name}")
        QTest.keyPress(window.windowHandle(), self.held)

    def spot(self, window: QWidget) -> QPoint:
        """Return any place in a window, as large as it is on the screen by now."""
        size = window.windowHandle().size().boundedTo(window.size())
        return QPoint(
            self.random.randrange(max(size.width(), 1)),
            self.random.randrange(max(size.height(), 1)),
        )

    def click(self, window: QWidget) -> None:
        """Click anywhere, once or twice."""
        at, button = self.spot(window), self.random.choice(BUTTONS)
        mask = self.random.choice(MODIFIERS)
        self.note(f"click {button.name} at {at.x()} {at.y()} {mask.name or mask}")
        self._click(window, button, mask, at)
        if self.random.random() < 0.2 and isValid(window) and window.isVisible():
            self._click(window, button, mask, at)

    def _click(
        self,
        window: QWidget,
        button: Qt.MouseButton,
        mask: Qt.KeyboardModifier,
        at: QPoint,
    ) -> None:
        handle = window.windowHandle()
        number = number_of(handle)
        QTest.mousePress(handle, button, mask, at)
        if is_there(number):
            QTest.mouseRelease(handle, button, mask, inside(handle, at))

    def press_button(self, window: QWidget) -> None:
        """Click on a button that can be seen."""
        shown = [
            button
            for button in window.findChildren(QAbstractButton)
            if button.isVisible() and button.isEnabled()
        ]
        if not shown:
            return
        button = self.random.choice(shown)
        at = button.mapTo(window, button.rect().center())
        if not QRect(QPoint(0, 0), window.windowHandle().size()).contains(at):
            return
        self.note(f"button {button.text() or type(button).__name__!r}")
        self._click(window, Button.LeftButton, Modifier.NoModifier, at)

    def drag(self, window: QWidget) -> None:
        """Drag from anywhere to anywhere, in a few steps."""
        begin, end = self.spot(window), self.spot(window)
        button, handle = self.random.choice(BUTTONS), window.windowHandle()
        text = f"{begin.x()} {begin.y()} to {end.x()} {end.y()}"
        self.note(f"drag {button.name} {text}")
        number = number_of(handle)
        QTest.mousePress(handle, button, Modifier.NoModifier, begin)
        steps = self.random.randrange(1, 8)
        for n in range(1, steps + 1):
            if not is_there(number):
                return
            QTest.mouseMove(handle, inside(handle, begin + (end - begin) * n / steps))
        if is_there(number):
            QTest.mouseRelease(handle, button, Modifier.NoModifier, inside(handle, end))

    def wheel(self, window: QWidget) -> None:
        """Turn the wheel anywhere."""
        at, steps = self.spot(window), self.random.choice([-5, -1, -1, 1, 1, 5])
        self.note(f"wheel {steps} at {at.x()} {at.y()}")
        QTest.wheelEvent(window.windowHandle(), at, QPoint(0, 120 * steps))

    def resize(self, window: QWidget) -> None:
        """Give the window another size."""
        size = self.random.choice([(640, 480), (1280, 720), (1920, 1080), (900, 1000)])
        self.note(f"resize {size}")
        window.resize(*size)

    # -- the end -----------------------------------------------------------------

    def end(self) -> None:
        """Close the window as its close box does; if it asks, let it be closed."""
        faulthandler.cancel_dump_traceback_later()
        self._looks.stop()
        self.note("the end")
        for widget in QApplication.topLevelWidgets():
            if hasattr(widget, "shut"):
                widget.shut()

    def told(self) -> dict[str, Any]:
        """Return what came of it."""
        self.waits.child.kill()
        self.waits.child.wait()
        return {
            "events": self.events,
            "seconds": round(time.monotonic() - self.begun_s, 1),
            "was_ended": time.monotonic() > self.until_s,
            "pages": dict(self.pages),
            "stalls": self.stalls,
        }


def main(seed: int, seconds: float, log: Path) -> int:
    """Start the program with a monkey before its window."""
    import app.window.application as application
    from app.__main__ import main as paravol

    # where it is the interpreter that ends, it says where it was
    faulthandler.enable()
    made = application.make_application
    monkeys: list[Monkey] = []

    def with_monkey() -> QApplication:
        qt = made()
        monkeys.append(Monkey(seed, seconds, log))
        return qt

    application.make_application = with_monkey
    status = paravol(["train"])
    faulthandler.cancel_dump_traceback_later()
    print()
    print(json.dumps(monkeys[0].told()), flush=True)
    return status


if __name__ == "__main__":
    raise SystemExit(main(int(sys.argv[1]), float(sys.argv[2]), Path(sys.argv[3])))
