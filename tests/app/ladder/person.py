"""A simulated person who does an exercise of the ladder by mouse, wheel and keys.

He sees what is on the screen, a reaction late (`eyes`), and acts with a hand that
trembles (`hand`). How a stroke moves the picture he learns by doing, as everybody does.
"""

import math
import random
import time
from collections.abc import Callable
from typing import TextIO

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEventLoop, Qt, QTimer
from PySide6.QtWidgets import (
    QLabel,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QWidget,
)

from app.window.home.exercise_card import ExerciseCard
from app.window.main_window import MainWindow
from app.window.page import TextPage
from app.window.panels.endoscope_panel import PictureView
from tests.app.ladder.eyes import REACTION_S, Eyes, Mark, Sight
from tests.app.ladder.hand import Hand

WRONG_TURNS = 0.03
"""Share of strokes that go where they should not."""

SHARE_PER_PX, LEVER_MM = 0.0006, 25.0
"""How far a stroke moves what is far away, before he has learnt it; and twice as much
what is so near: the tip moves, too."""

LONGEST_PX = 170.0
MM_PER_NOTCH = 1.5
LATE_S = 20.0
"""He waits so long for a new picture, on a slow machine."""

Key, Button = Qt.Key, Qt.MouseButton
ALL_DONE = "All tasks are done"


class LostError(Exception):
    """He gives up, and says why."""


class Person:
    """Sit before a window."""

    def __init__(
        self, window: MainWindow, seed: int, log: TextIO | None = None
    ) -> None:
        self.window = window
        self.rng = random.Random(seed)
        self.eyes = Eyes(window)
        self.hand = Hand(window, self.rng, self.wait)
        self._log = log
        self._per_px: NDArray[np.float64] = -SHARE_PER_PX * np.eye(2)
        self._last_stroke: NDArray[np.float64] = np.zeros(2)
        self.until_s = math.inf

    def say(self, words: str) -> None:
        """Think aloud."""
        if self._log is not None:
            print(f"{time.monotonic() % 1000:7.2f} {words}", file=self._log, flush=True)

    def wait(self, time_s: float) -> None:
        """Let the window go on."""
        loop = QEventLoop()
        QTimer.singleShot(max(round(time_s * 1e3), 1), loop.quit)
        loop.exec()

    def wait_for(self, what: str, holds: Callable[[], object], limit_s: float) -> None:
        """Wait until something can be seen; give up after a while."""
        began = time.monotonic()
        while not holds():
            if time.monotonic() - began > limit_s:
                raise LostError(f"waited {limit_s:.0f} s for {what}")
            self.wait(0.05)

    def look(self) -> Sight:
        """See what came of the last act: a picture that is newer, a reaction later."""
        began = time.monotonic()
        pictures = self.eyes.sight.pictures
        self.wait(REACTION_S)
        while time.monotonic() - began < LATE_S:
            seen = self.eyes.sight
            if seen.at_s >= began and (
                seen.pictures > pictures or seen.page != "FlightPage"
            ):
                break
            self.wait(0.03)
        if time.monotonic() > self.until_s:
            raise LostError("the time is over")
        return self.eyes.sight

    # The pages

    def choose(self, title: str, group: str = "") -> None:
        """Click a line of the home page's list, by what stands there."""
        self.wait_for("the list", lambda: self._row(title) is not None, 60.0)
        lines = self._list()
        for _ in range(60):
            item = self._row(title)
            assert item is not None
            place = lines.visualItemRect(item)
            view = lines.viewport()
            if place.top() >= 0 and place.bottom() <= view.height():
                x = 40.0 / view.width()
                self.hand.click(view, x, place.center().y() / view.height())
                self.wait(0.2)
                return
            self.hand.point(view)
            self.hand.wheel(-1 if place.bottom() > view.height() else 1)
        raise LostError(f"{title} cannot be scrolled to")

    def _list(self) -> QTreeWidget:
        found = self.window.page.findChild(QTreeWidget)
        assert found is not None
        return found

    def _row(self, title: str) -> QTreeWidgetItem | None:
        lines = self.window.page.findChild(QTreeWidget)
        if lines is None:
            return None
        rows = (lines.topLevelItem(n) for n in range(lines.topLevelItemCount()))
        return next((r for r in rows if r is not None and r.text(0) == title), None)

    def button(self, words: str) -> QPushButton | None:
        """Find a button by what stands on it."""
        for found in self.window.page.findChildren(QPushButton):
            if found.isVisible() and found.text().startswith(words):
                return found
        return None

    def click_button(self, words: str) -> None:
        """Click a button by what stands on it."""

        def ready() -> bool:
            found = self.button(words)
            return found is not None and found.isEnabled()

        self.wait_for(f"the button {words}", ready, 60.0)
        found = self.button(words)
        assert found is not None
        self.hand.click(found)

    def start(self, title: str) -> None:
        """Start an exercise from the home page."""
        for _ in range(5):
            self.choose(title)
            # he reads on the card what he is about to start
            self.wait(REACTION_S)
            card = self.window.page.findChild(ExerciseCard)
            if card is None:
                continue
            headings = [w.text() for w in card.findChildren(QLabel, "heading")]
            if title in headings:
                self.click_button("Start")
                return
        raise LostError(f"{title} cannot be chosen")

    def first_picture(self, limit_s: float) -> None:
        """Wait until the flight's picture is there."""

        def there() -> bool:
            sight = self.eyes.sight
            if sight.page == "HomePage":
                problem = self.window.page.findChild(QLabel, "problem")
                if problem is not None and problem.isVisible():
                    raise LostError(f"it says: {problem.text()}")
            if sight.page not in ("HomePage", "FlightPage", ""):
                raise LostError(f"it says: {' · '.join(self.eyes.texts())}")
            # the clock runs once all that is needed can be seen
            clock = sight.gauges.get("Time", "")
            return sight.page == "FlightPage" and clock > "0:00.4"

        self.wait_for("the first picture", there, limit_s)
        self.wait(REACTION_S)

    def end(self) -> list[str]:
        """End the flight and read its result."""
        self.hand.tap(Key.Key_Q)
        self.wait(0.5)
        self.hand.tap(Key.Key_Return)
        self.wait_for("the result", lambda: self.eyes.sight.page == "ResultPage", 120.0)

        def scored() -> bool:
            page = self.window.page
            return not (isinstance(page, TextPage) and page.share.isVisible())

        self.wait(1.0)
        self.wait_for("the score", scored, 400.0)
        self.wait(0.5)
        return self.eyes.texts()

    def go_home(self) -> None:
        """Click Home, and again where it moved away from under the mouse."""
        for _ in range(6):
            self.click_button("Home")
            try:
                self.wait_for(
                    "the home page", lambda: self.eyes.sight.page == "HomePage", 10.0
                )
            except LostError:
                continue
            return
        raise LostError("the home page is not found")

    # The flight

    @property
    def picture(self) -> QWidget:
        """Return the scope's picture."""
        found = self.window.page.findChild(PictureView)
        assert found is not None
        return found

    def stroke(self, right_px: float, down_px: float, button: Qt.MouseButton) -> None:
        """Drag over the picture, beginning near its middle; seldom the wrong way."""
        self.hand.point(
            self.picture, self.rng.uniform(0.4, 0.6), self.rng.uniform(0.4, 0.6)
        )
        if self.rng.random() < WRONG_TURNS:
            self.say("a wrong turn")
            right_px, down_px = -down_px, right_px
        self.hand.drag(right_px, down_px, button)

    def go(self, notches: int) -> None:
        """Move the scope in, or out."""
        self.hand.point(self.picture, 0.5, 0.5)
        self.hand.wheel(notches)

    def aim(self, error: tuple[float, float], mark: Mark) -> None:
        """Tilt so that a mark moves by so many shares of the picture; learn from it."""
        wish = np.array(error)
        near = 1.0 + LEVER_MM / max(mark.mm, 2.0)
        stroke = np.linalg.solve(near * self._per_px, wish)
        length = float(np.linalg.norm(stroke))
        if length > LONGEST_PX:
            stroke *= LONGEST_PX / length
        self._last_stroke = stroke
        self.stroke(float(stroke[0]), float(stroke[1]), Button.LeftButton)
        after = self.look().mark
        if after is None or after.is_goal != mark.is_goal or after.words != mark.words:
            return
        moved = np.array([after.x - mark.x, after.y - mark.y])
        if after.is_in and mark.is_in:
            self._learn(stroke, moved / near)
            return
        # of what was at the rim he knows only that it moved so far at least
        meant = near * float(np.linalg.norm(self._per_px @ stroke))
        more = float(np.linalg.norm(moved)) / max(meant, 1e-6)
        if more > 1.2:
            self._per_px *= min(more, 2.0)

    def _learn(self, stroke: NDArray[np.float64], moved: NDArray[np.float64]) -> None:
        """Take in what a stroke did (Broyden's rule), as far as it makes sense."""
        if float(stroke @ stroke) < 64.0:
            return
        off = moved - self._per_px @ stroke
        tried = self._per_px + 0.5 * np.outer(off, stroke) / float(stroke @ stroke)
        size = np.linalg.svd(tried, compute_uv=False)
        if size[1] > 0.0002 and size[0] < 0.005:
            self._per_px = tried
        else:
            self._per_px = -SHARE_PER_PX * np.eye(2)

    def ease(self) -> None:
        """Take a part of the last stroke back: it led to a wall."""
        right_px, down_px = (-0.5 * self._last_stroke).tolist()
        self.stroke(right_px, down_px, Button.LeftButton)

    def roll(self, turn_deg: float) -> None:
        """Turn the light post by about so much."""
        self.stroke(turn_deg / 0.25, 0.0, Button.RightButton)
