"""What the simulated person does with a tool: bring it to the mark, and work.

The mouse is the tool's: its tip follows the pointer, the wheel moves it deeper. The
right button and Ctrl with the wheel keep the scope.
"""

import math
import re
from collections.abc import Callable
from typing import Protocol

from PySide6.QtCore import Qt

from tests.app.ladder.eyes import Mark, Sight
from tests.app.ladder.person import LostError, Person

TOOLS = (
    ("inject", ("injection needle",)),
    ("polyp", ("microdebrider",)),
    ("uncinate", ("straight forceps", "backbiter", "microdebrider")),
    ("ostium", ("through-cutting punch", "backbiter", "straight forceps")),
    ("bulla", ("microdebrider", "straight forceps", "curette")),
    ("cells", ("microdebrider", "upturned forceps", "curette")),
    ("superior turbinate", ("through-cutting punch", "straight forceps")),
)
"""What a person takes first for what a task speaks of, and what then."""

NEAREST_MM, FARTHEST_MM, WAY_MM = 9.0, 18.0, 16.0
"""From the scope to where one operates; the last where one does not see it yet: the
tool goes the rest of the way."""

BESIDE = 0.36
"""Farther off the picture's middle nothing is operated."""

AT_MM, NEAR_MM = 3.0, 6.5
"""A tool whose tip is so near to the mark works; the second where tissue is between."""

BITE_S, INJECT_S, SHAVE_S = 0.6, 1.9, 1.2
VAIN = 5
"""Strokes that took nothing, before another tool is tried."""

Key, Button = Qt.Key, Qt.MouseButton


class Steers(Protocol):
    """Bring the scope to the mark; see `skills.Trainee`."""

    def approach(self, sight: Sight, *, finely: bool = False) -> None: ...
    def bring(self, sight: Sight, mark: Mark) -> None: ...


def is_for_tool(words: str) -> bool:
    """Return whether a task is done with a tool, by what it says."""
    low = words.lower()
    return low.startswith(("take ", "widen ", "inject ")) or "with the tool" in low


class Surgeon:
    """Do tasks with tools, act by act.

    steers: brings the scope there first.
    """

    def __init__(self, person: Person, steers: Steers, shoot: Callable[[str], None]):
        """Begin with an empty hand."""
        self._person, self._steers, self._shoot = person, steers, shoot
        self._task = ""
        self._choice = 0
        self._vain = self._waits = 0
        self._aside = (0.0, 0.0)
        self._shots = 0
        self._least_mm = math.inf

    def operate(self, sight: Sight) -> None:
        """Do one act of the task."""
        if sight.task != self._task:
            self._task, self._choice, self._vain = sight.task, 0, 0
            self._renew()
        mark = sight.mark
        tool = _in_hand(sight)
        if tool and tool != self._wanted(sight):
            self._take(sight)
            return
        if mark is None:
            self._person.wait(0.4)
            self._waits += 1
            if self._waits > 10:
                raise LostError("nothing is marked")
            return
        off = math.hypot(mark.x - 0.5, mark.y - 0.5)
        if not tool:
            if mark.mm > (FARTHEST_MM if mark.is_goal else WAY_MM):
                self._steers.approach(sight)
            elif not mark.is_in or off > BESIDE:
                self._steers.bring(sight, mark)
            elif mark.mm < NEAREST_MM:
                self._person.go(-2)
            else:
                self._take(sight)
            return
        if not mark.is_in or off > 0.47:
            self._follow(mark)
            return
        self._point_at(mark)
        self._work_at(sight, mark)

    def _renew(self) -> None:
        self._waits, self._aside, self._least_mm = 0, (0.0, 0.0), math.inf

    def _wanted(self, sight: Sight) -> str:
        low = sight.task.lower()
        for words, tools in TOOLS:
            if words in low:
                return tools[self._choice % len(tools)]
        raise LostError(f"no tool for: {sight.task}")

    def _take(self, sight: Sight) -> None:
        """Go through the tools until the wanted one is in hand."""
        person, wanted = self._person, self._wanted(sight)
        for _ in range(14):
            if _in_hand(person.look()) == wanted:
                break
            person.hand.tap(Key.Key_T)
            person.wait(0.15)
        else:
            raise LostError(f"there is no {wanted}")
        person.say(f"takes the {wanted}")
        if "suction off" in person.look().tool:
            person.hand.tap(Key.Key_N)
        self._renew()
        person.wait(1.0)

    def put_away(self) -> None:
        """Empty the hand."""
        for _ in range(14):
            if not _in_hand(self._person.look()):
                return
            self._person.hand.tap(Key.Key_T)
            self._person.wait(0.15)

    def _point_at(self, mark: Mark) -> None:
        """Bring the pointer onto the mark, as a hand can."""
        person = self._person
        x = mark.x + self._aside[0] + person.rng.gauss(0.0, 0.004)
        y = mark.y + self._aside[1] + person.rng.gauss(0.0, 0.004)
        person.hand.glide(person.picture, x, y)

    def _follow(self, mark: Mark) -> None:
        """Let the scope follow, with the right button, until the mark is seen."""
        person = self._person
        person.say("the scope follows")
        person.hand.point(person.picture, 0.5, 0.5)
        stroke = 240.0
        person.hand.drag(
            stroke * (mark.x - 0.5), stroke * (mark.y - 0.5), Button.RightButton
        )

    def _work_at(self, sight: Sight, mark: Mark) -> None:
        """Wait until the tip is there, then work; see what was taken."""
        person = self._person
        person.wait(0.5)
        now = person.look()
        there = now.mark
        if there is None or now.task != self._task:
            return
        is_near = there.mm <= AT_MM or (self._waits >= 2 and there.mm <= NEAR_MM)
        if not is_near and not self._presses(now):
            self._waits += 1
            if there.mm < self._least_mm - 0.7:
                self._least_mm, self._waits = there.mm, 0
            person.hand.wheel(2)
            if self._waits > 6:
                person.say(f"the tool does not get there: {there.mm:.0f} mm {now.said}")
                self._elsewhere()
            return
        before = now.bar
        low = self._task.lower()
        time_s = INJECT_S if "inject" in low else BITE_S
        if "suction on" in now.tool:
            time_s = SHAVE_S
        person.hand.press(Button.LeftButton)
        person.wait(time_s)
        person.hand.release(Button.LeftButton)
        person.wait(0.3)
        after = person.look()
        person.say(f"    worked: {after.said} bar {before:.2f} {after.bar:.2f}")
        if self._shots < 6:
            self._shoot(f"work-{self._shots}")
            self._shots += 1
        spared = re.search(r"(middle|inferior) turbinate (\d+)", after.said)
        if spared is not None:
            # away from what is to be spared
            self._aside = (
                person.rng.uniform(-0.04, 0.04),
                person.rng.uniform(-0.04, 0.04),
            )
        if after.bar > before + 0.004:
            self._vain = 0
            return
        self._vain += 1
        person.hand.wheel(1)
        if self._vain >= VAIN:
            self._elsewhere()

    def _presses(self, sight: Sight) -> bool:
        return (
            "(tool)" in sight.touching
            and sight.mark is not None
            and (sight.mark.mm < 2.0 * AT_MM)
        )

    def _elsewhere(self) -> None:
        """Try another tool, from another place of the scope."""
        person = self._person
        self._vain = 0
        self._choice += 1
        self.put_away()
        self._renew()
        person.go(-person.rng.randint(1, 3))
        person.stroke(
            person.rng.uniform(-50.0, 50.0),
            person.rng.uniform(-50.0, 50.0),
            Button.LeftButton,
        )


def _in_hand(sight: Sight) -> str:
    """Return the tool in hand, by its label; "" for none."""
    words = sight.tool.partition(":")[2].strip().lower()
    found = next((t for _, ts in TOOLS for t in ts if words.startswith(t)), "")
    if found:
        return found
    return "" if not words or words.startswith("no") else words
