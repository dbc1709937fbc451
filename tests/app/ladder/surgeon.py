"""What the simulated person does with a tool: bring it to the mark, and work.

The mouse is the tool's: its tip follows the pointer, the wheel moves it deeper. The
right button and Ctrl with the wheel keep the scope.
"""

import math
import time
from collections.abc import Callable
from typing import Protocol

from PySide6.QtCore import Qt

from tests.app.ladder.eyes import Mark, Sight
from tests.app.ladder.person import LostError, Person

TOOLS = (
    ("inject", ("injection needle",)),
    ("polyp", ("straight forceps", "microdebrider")),
    ("uncinate", ("straight forceps", "backbiter", "backbiter", "backbiter")),
    ("ostium", ("backbiter", "through-cutting punch", "straight forceps")),
    ("bulla", ("microdebrider", "straight forceps", "curette")),
    ("cells", ("microdebrider", "upturned forceps", "curette")),
    ("superior turbinate", ("through-cutting punch", "straight forceps")),
)
"""What a person takes first for what a task speaks of, and what then."""

NEAREST_MM, FARTHEST_MM, WAY_MM = 9.0, 18.0, 16.0
"""From the scope to where one operates; the last where one does not see it yet: the
tool goes the rest of the way."""

BESIDE = 0.27
"""Farther off the picture's middle nothing is operated."""

AT_MM, NEAR_MM = 3.0, 6.5
"""A needle whose point is so near to the mark is pressed; the second where tissue is
between."""

BITE_S, INJECT_S, SHAVE_S = 1.6, 1.9, 1.2
LEAST_MM3, SPARES_MM3 = 1.0, 1.0
"""A bite that is worth it where larger ones are not found; and what he risks of what is
to be spared, as it is told."""

SPARED = "turbinate", "lamina", "septal", "orbit", "carotid", "artery", "nerve", "duct"
"""Words of what he does not bite."""

STEPS, WIDER, GOLDEN = 4, 0.02, 2.4
"""Places about the mark at which he points, in shares of the picture."""

SHORT_MM = 2.5
"""A tool that stops so far before the mark is moved on."""

SETTLES_S, SEEN_S, MOVED = 2.2, 0.45, 0.04
"""He waits so long for the tool to say what it would take; what it said before he
points does not count. And a mark that has moved so far is another."""

STRAYS = 12
"""Acts that bring the scope no nearer, before it goes in anew."""

FOLLOWS = 4
"""Strokes by which the scope is to see the mark, before it is laid anew."""

SEEN_ANEW_S = 3.0
"""So long after he moved, the guide has looked for another place."""

PRICKS = 5
"""Tries with a needle, before the scope goes elsewhere."""

VAIN = 2
"""Rounds in which nothing was found, before another tool is tried."""

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
        self._shots = self._moves = 0
        self._moved_s, self._stand_mm = 0.0, FARTHEST_MM
        self._near_mm, self._strays = math.inf, 0
        self._follows = 0

    def operate(self, sight: Sight) -> None:
        """Do one act of the task."""
        if sight.task != self._task:
            self._task, self._choice = sight.task, 0
            self._near_mm, self._strays = math.inf, 0
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
            if mark.mm > (self._stand_mm if mark.is_goal else WAY_MM):
                self._near_mm = min(self._near_mm, mark.mm)
                self._strays = 0 if mark.mm <= self._near_mm else self._strays + 1
                if self._strays > STRAYS:
                    # from here he does not get there
                    self._anew()
                else:
                    self._steers.approach(sight)
            elif not mark.is_in or off > BESIDE:
                self._steers.bring(sight, mark)
            elif mark.mm < min(NEAREST_MM, self._stand_mm - 6.0):
                self._person.go(-2)
            else:
                self._take(sight)
            return
        if not mark.is_goal and mark.mm > FARTHEST_MM:
            # it is hidden, and far from the tool: the scope goes first
            self.put_away()
            self._renew()
        elif mark.has_no_way and time.monotonic() > self._moved_s + SEEN_ANEW_S:
            self._elsewhere()
        elif not mark.is_in or off > 0.47:
            self._follow(mark)
        elif "inject" in self._task.lower():
            self._prick(mark)
        else:
            self._follows = 0
            self._bite(sight, mark)

    def _renew(self) -> None:
        self._waits = self._vain = 0

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
        self._moved_s = time.monotonic()
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

    def _follow(self, mark: Mark) -> None:
        """Let the scope follow, with the right button, until the mark is seen."""
        person = self._person
        person.say("the scope follows")
        self._follows += 1
        if self._follows > FOLLOWS:
            # it does not move any more
            self._anew()
            return
        person.hand.point(person.picture, 0.5, 0.5)
        stroke = 240.0
        person.hand.drag(
            stroke * (mark.x - 0.5), stroke * (mark.y - 0.5), Button.RightButton
        )

    def _prick(self, mark: Mark) -> None:
        """Bring the needle to the mark, and inject."""
        person = self._person
        person.hand.glide(person.picture, mark.x, mark.y)
        person.wait(0.35)
        now = person.look()
        if now.mark is None or now.task != self._task:
            return
        if now.mark.mm <= (NEAR_MM if self._vain >= 2 else AT_MM):
            self._work(now, INJECT_S)
        else:
            self._vain += 1
        if self._vain:
            person.hand.wheel(2)
        if self._vain > PRICKS:
            person.say(f"the needle does not get there: {now.mark.mm:.0f} mm")
            self._elsewhere()

    def _bite(self, sight: Sight, mark: Mark) -> None:
        """Point at the mark, and about it, until the tool says what it would take."""
        person = self._person
        for step in range(STEPS):
            away = WIDER * step
            x = mark.x + away * math.cos(GOLDEN * step)
            y = mark.y + away * math.sin(GOLDEN * step)
            person.hand.glide(person.picture, x, y)
            if sight.mark is not None and sight.mark.mm > SHORT_MM:
                # the wheel lets it go as far as tissue
                person.hand.wheel(4)
            began = time.monotonic()
            while time.monotonic() - began < SETTLES_S:
                person.wait(0.1)
                sight = person.eyes.sight
                if sight.mark is None or sight.task != self._task:
                    return
                if sight.at_s > began + SEEN_S and self._is_ready(sight):
                    self._work(sight, SHAVE_S if "suction on" in sight.tool else BITE_S)
                    return
            if sight.mark is None:
                return
            moved = math.hypot(sight.mark.x - mark.x, sight.mark.y - mark.y)
            if moved > MOVED:
                # it is marked elsewhere by now
                return
        person.say(f"    nothing here: {sight.mark.mm if sight.mark else 0:.0f} mm")
        self._vain += 1
        if self._vain >= VAIN:
            self._elsewhere()

    def _work(self, now: Sight, time_s: float) -> None:
        """Press for a while; see what came of it."""
        person = self._person
        before = now.bar
        person.hand.press(Button.LeftButton)
        person.wait(time_s)
        person.hand.release(Button.LeftButton)
        person.wait(0.3)
        after = person.look()
        person.say(
            f"    worked: {now.bite} {after.said} bar {before:.2f} {after.bar:.2f}"
        )
        if self._shots < 6:
            self._shoot(f"work-{self._shots}")
            self._shots += 1
        if "Taken" in after.said or after.bar > before + 0.004:
            self._vain = 0
        else:
            self._vain += 1

    def _is_ready(self, sight: Sight) -> bool:
        """Return whether what the tool would take is wanted, and nothing else is."""
        if sight.mark is None or not sight.bite:
            return False
        words = f"{sight.mark.words} {self._task}".lower()
        named = {n: v for n, v in sight.bite.items() if n.split()[0] in words}
        spared = [v for n, v in sight.bite.items() if n not in named and _is_spared(n)]
        if sum(spared) > SPARES_MM3:
            return False
        wanted = named if "uncinate" in words or "polyp" in words else sight.bite
        enough = LEAST_MM3 if self._vain or self._moves else 2.0 * LEAST_MM3
        return sum(wanted.values()) >= enough

    def _elsewhere(self) -> None:
        """Tilt the scope a little; now and then begin anew, with another tool."""
        person = self._person
        self._moves += 1
        self._moved_s = time.monotonic()
        rng = person.rng
        if self._moves % 3:
            person.hand.point(person.picture, 0.5, 0.5)
            aside = rng.uniform(-90.0, 90.0), rng.uniform(-90.0, 90.0)
            person.hand.drag(*aside, Button.RightButton)
            self._vain = 0
            return
        self._choice += 1
        self._anew()

    def _anew(self) -> None:
        """Draw back, and let the scope look at the place from elsewhere."""
        person, rng = self._person, self._person.rng
        person.say("anew")
        self.put_away()
        self._renew()
        self._follows = self._strays = 0
        self._near_mm = math.inf
        # from nearer, or from farther away, another way is free
        self._stand_mm = rng.uniform(NEAREST_MM + 1.0, FARTHEST_MM + 6.0)
        person.go(-4)
        person.stroke(
            rng.uniform(-60.0, 60.0), rng.uniform(-60.0, 60.0), Button.LeftButton
        )


def _is_spared(tissue: str) -> bool:
    return any(word in tissue for word in SPARED)


def _in_hand(sight: Sight) -> str:
    """Return the tool in hand, by its label; "" for none."""
    words = sight.tool.partition(":")[2].strip().lower()
    found = next((t for _, ts in TOOLS for t in ts if words.startswith(t)), "")
    if found:
        return found
    return "" if not words or words.startswith("no") else words
