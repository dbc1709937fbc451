"""What the simulated person does with a tool: bring it to the mark, and work.

The mouse is the tool's: its tip follows the pointer, the wheel moves it deeper. The
right button and Ctrl with the wheel keep the scope.
"""

import math
import time
from collections import Counter
from collections.abc import Callable

from PySide6.QtCore import Qt

from tests.app.ladder.eyes import Mark, Sight
from tests.app.ladder.person import LostError, Person

TOOLS = (
    ("inject", ("injection needle",)),
    ("polyp", ("straight forceps", "microdebrider")),
    ("uncinate", ("through-cutting punch", "backbiter", "straight forceps")),
    ("ostium", ("through-cutting punch", "backbiter", "straight forceps")),
    ("bulla", ("through-cutting punch", "straight forceps", "backbiter")),
    ("cells", ("through-cutting punch", "straight forceps", "upturned forceps")),
    ("superior turbinate", ("through-cutting punch", "straight forceps")),
)
"""What a person takes first for what a task speaks of, and what then."""

AT_MM, NEAR_MM = 3.0, 6.5
"""A needle whose point is so near to the mark is pressed; the second where tissue is
between."""

BITE_S, INJECT_S, SHAVE_S = 1.6, 1.9, 1.2
WORTH_IT, POOR = 0.012, 1
"""A bite that brings less is not worth many more from there: so many."""

WANTED_MM3, LEAST_MM3, MOST_LAYS = 1.0, 0.3, 2
"""A bite that is worth it, and one where larger ones are not found from so many places
of the scope."""

SPARES_MM3, SPARES, THIN_MM3 = 1.0, 0.03, 0.4
"""What he risks of what is to be spared, as it is told, or so much of what he wants;
the third of the thin plate to the orbit."""

ALLOWED_MM3, MORE_MM3 = 2.7, 1.2
"""He risks no more in all of each tissue that is to be spared; of turbinates more by
the second where nothing else is found: of them five are allowed."""

SPARED = "turbinate", "lamina", "septal"
NEVER = "orbit", "carotid", "artery", "nerve", "duct"
"""Words of what he takes care of, and of what he does not bite at all."""

MAY_GO = {"ostium": "superior turbinate"}
"""What may go in part while a task is done, as its exercise says."""

STEPS, WIDER, GOLDEN = 2, 0.02, 2.4
"""Places about the mark at which he points, in shares of the picture."""

SHORT_MM = 2.5
"""A tool that stops so far before the mark is moved on."""

SETTLES_S, SEEN_S, GROWS_S, MOVED = 1.8, 0.45, 0.35, 0.04
"""He waits so long for the tool to say what it would take; what it said before he
points does not count; and what it says has not grown for the third. And a mark that has
moved so far is another."""

COMING_MM, COMES_S, FAR_MM = 1.5, 7.0, 10.0
"""A tool that has moved by so much still comes, or is turned; so long at most. One that
is so far away then comes nowhere near."""

LAYS_S, STILL_S, STILL = 20.0, 1.2, 0.01
"""An assistant who lays the scope is waited for so long at most: until what is marked
has not moved for the second, by the third at most."""

FOUND = "lays the scope", "From nowhere", "There is no tool", "No tool is needed"
"""What is said once it is known where the scope is to lie."""

TAKEN_S = 2.0
"""He waits so long to see what he has taken."""

ELSEWHERE = 2
"""Places of the scope that lead to nothing, before another tool is tried."""

PRICKS = 5
"""Tries with a needle, before the scope goes elsewhere."""

VAIN, BITES, FEW_MM3 = 1, 3, 25.0
"""Rounds in which nothing was found, before the scope is laid elsewhere; it is, too,
after so many bites: what is left lies elsewhere then. Where they brought less than the
third, another tool may bring more."""

Key, Button = Qt.Key, Qt.MouseButton


def is_for_tool(words: str) -> bool:
    """Return whether a task is done with a tool, by what it says."""
    low = words.lower()
    return low.startswith(("take ", "widen ", "inject ")) or "with the tool" in low


class Surgeon:
    """Do tasks with tools, act by act.

    An assistant lays the scope; he points with the tool.
    """

    def __init__(self, person: Person, shoot: Callable[[str], None]):
        """Begin with an empty hand."""
        self._person, self._shoot = person, shoot
        self._task = ""
        self._choice = self._vain = self._waits = self._shots = 0
        self._bites: list[float] = []
        self._lays, self._is_laid, self._told = 0, False, ""
        self._risked_mm3: Counter[str] = Counter()
        self._missing: set[str] = set()

    def operate(self, sight: Sight) -> None:
        """Do one act of the task."""
        if sight.task != self._task:
            self._task, self._choice, self._told = sight.task, 0, ""
            self._renew()
        mark = sight.mark
        if "gets there: The " in sight.said:
            # the assistant knows which tool does
            self._told = sight.said.partition("gets there: The ")[2][:-6].lower()
        if _in_hand(sight) != self._wanted(sight):
            self._take(sight)
        elif not self._is_laid:
            self._lay()
        elif mark is None:
            self._person.wait(0.4)
            self._waits += 1
            if self._waits > 10:
                raise LostError("nothing is marked")
        elif mark.has_no_way or not mark.is_in:
            self._elsewhere()
        elif "inject" in self._task.lower():
            self._prick(mark)
        else:
            self._bite(sight, mark)

    def _renew(self) -> None:
        self._waits = self._vain = 0
        self._is_laid, self._bites = False, []

    def _wanted(self, sight: Sight) -> str:
        low = sight.task.lower()
        if self._told:
            return self._told
        for words, tools in TOOLS:
            if words in low:
                there = [tool for tool in tools if tool not in self._missing]
                if there:
                    return there[self._choice % len(there)]
        raise LostError(f"no tool for: {sight.task}")

    def _take(self, sight: Sight) -> None:
        """Go through the tools until the wanted one is in hand."""
        person, wanted = self._person, self._wanted(sight)
        for _ in range(14):
            if _in_hand(person.look()) == wanted:
                break
            person.hand.tap(Key.Key_T)
            self._see_change(person.eyes.sight.tool)
        else:
            person.say(f"there is no {wanted}")
            self._missing.add(wanted)
            self._told = ""
            return
        person.say(f"takes the {wanted}")
        if "suction off" in person.look().tool:
            person.hand.tap(Key.Key_N)
        self._renew()
        person.wait(1.0)

    def _see_change(self, tool: str) -> None:
        """Wait until another tool is named than before."""
        person, began = self._person, time.monotonic()
        while person.eyes.sight.tool == tool:
            person.wait(0.05)
            if time.monotonic() - began > TAKEN_S:
                return

    def put_away(self) -> None:
        """Empty the hand."""
        for _ in range(14):
            if not _in_hand(self._person.look()):
                return
            self._person.hand.tap(Key.Key_T)
            self._person.wait(0.15)

    def _lay(self) -> None:
        """Let the assistant lay the scope, and wait until it lies."""
        person = self._person
        person.hand.tap(Key.Key_R)
        began = still = time.monotonic()
        before, has_found = None, False
        while time.monotonic() - began < LAYS_S:
            person.wait(0.1)
            now = person.eyes.sight
            has_found |= any(words in now.said for words in FOUND)
            mark = now.mark if has_found else None
            if mark is None or before is None or not _is_same(mark, before):
                still, before = time.monotonic(), mark
            if time.monotonic() - still > STILL_S:
                break
        self._is_laid, self._vain, self._waits = True, 0, 0
        person.say(f"laid: {person.eyes.sight.said}")

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
        for step in range(-1, STEPS):
            if step >= 0:
                away = WIDER * step
                x = mark.x + away * math.cos(GOLDEN * step)
                y = mark.y + away * math.sin(GOLDEN * step)
                person.hand.glide(person.picture, x, y)
                if sight.mark is not None and sight.mark.mm > SHORT_MM:
                    # the wheel lets it go as far as tissue
                    person.hand.wheel(4)
            elif not self._worth(sight)[0]:
                # nothing is told from where it lies already
                continue
            began = moved_s = grown_s = time.monotonic()
            before_mm, most_mm3 = math.inf, 0.0
            while time.monotonic() < min(moved_s + SETTLES_S, began + COMES_S):
                person.wait(0.1)
                sight = person.eyes.sight
                if sight.mark is None or sight.task != self._task:
                    return
                if abs(sight.mark.mm - before_mm) >= COMING_MM:
                    before_mm, moved_s = sight.mark.mm, time.monotonic()
                mm3, risks = self._worth(sight)
                if sight.at_s < began + SEEN_S or not mm3:
                    continue
                if mm3 > most_mm3 + 1.0:
                    # it is still coming
                    most_mm3, grown_s = mm3, time.monotonic()
                    moved_s = grown_s
                elif time.monotonic() - grown_s > GROWS_S:
                    self._risked_mm3 += risks
                    self._work(sight, SHAVE_S if "suction on" in sight.tool else BITE_S)
                    self._bites.append(mm3)
                    if len(self._bites) >= BITES:
                        self._choice += sum(self._bites) < FEW_MM3
                        self._renew()
                    return
            if sight.mark is None:
                return
            moved = math.hypot(sight.mark.x - mark.x, sight.mark.y - mark.y)
            if moved > MOVED:
                # it is marked elsewhere by now
                return
            if sight.mark.mm > FAR_MM:
                break
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
        if after.bar > before + WORTH_IT:
            self._vain = self._lays = 0
            return
        self._vain += 1
        if self._vain > POOR and "inject" not in self._task.lower():
            self._elsewhere()

    def _worth(self, sight: Sight) -> tuple[float, Counter[str]]:
        """Return what the tool would take of what is wanted and of what is spared, mm3.

        Nothing of the first where the second is too much for it.
        """
        if sight.mark is None or not sight.bite:
            return 0.0, Counter()
        words = f"{sight.mark.words} {self._task}".lower()
        named = {n: v for n, v in sight.bite.items() if n.split()[0] in words}
        may_go = [n for word, n in MAY_GO.items() if word in words]
        spared = Counter(
            {
                name: mm3
                for name, mm3 in sight.bite.items()
                if name not in named and name not in may_go and _is(name, SPARED)
            }
        )
        wanted = named if "uncinate" in words or "polyp" in words else sight.bite
        mm3 = sum(wanted.values())
        least_mm3 = WANTED_MM3 if self._lays < MOST_LAYS else LEAST_MM3
        risked = self._risked_mm3 + spared
        is_good = (
            mm3 >= least_mm3
            and not any(_is(name, NEVER) for name in sight.bite)
            and spared.total() <= max(SPARES_MM3, SPARES * mm3)
            and spared["lamina papyracea"] <= max(THIN_MM3, SPARES * mm3)
            and all(n <= self._most_mm3(name) for name, n in risked.items())
        )
        return mm3 * is_good, spared

    def _most_mm3(self, tissue: str) -> float:
        """Return how much he risks of a tissue in all."""
        is_last = self._lays >= MOST_LAYS and "turbinate" in tissue
        return ALLOWED_MM3 + MORE_MM3 * is_last

    def _elsewhere(self) -> None:
        """Have the scope laid elsewhere; now and then take another tool."""
        self._lays += 1
        if self._lays % ELSEWHERE == 0 or 0.0 < sum(self._bites) < FEW_MM3:
            self._choice, self._told = self._choice + 1, ""
        self._renew()


def _is_same(mark: Mark, other: Mark) -> bool:
    return math.hypot(mark.x - other.x, mark.y - other.y) < STILL


def _is(tissue: str, words: tuple[str, ...]) -> bool:
    return any(word in tissue for word in words)


def _in_hand(sight: Sight) -> str:
    """Return the tool in hand, by its label; "" for none."""
    words = sight.tool.partition(":")[2].strip().lower()
    found = next((t for _, ts in TOOLS for t in ts if words.startswith(t)), "")
    if found:
        return found
    return "" if not words or words.startswith("no") else words
