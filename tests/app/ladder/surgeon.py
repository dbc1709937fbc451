"""What the simulated person does with a tool: bring it to the mark, and work.

The mouse is the tool's: its tip follows the pointer, the wheel moves it deeper. The
right button and Ctrl with the wheel keep the scope.
"""

import math
from collections.abc import Callable
from typing import Protocol

from PySide6.QtCore import Qt

from tests.app.ladder.eyes import Mark, Sight
from tests.app.ladder.person import LostError, Person

TOOLS = (
    ("inject", ("injection needle",)),
    ("polyp", ("microdebrider",)),
    ("uncinate", ("backbiter", "backbiter", "straight forceps")),
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

BITE_S, INJECT_S, SHAVE_S = 0.5, 1.9, 1.2
LEAST_MM3 = 1.0
"""A bite that is worth it where larger ones are not found."""

SPARED = "turbinate", "lamina", "septal", "orbit", "carotid", "artery", "nerve", "duct"
"""Words of what he does not bite."""

HAZARD_MM = 0.9
"""Nearer to a hazard he does not bite."""

TURNS = 0, 2, -2, 4, -4, 0, 6, -6
"""Turns of the wrist that he tries, in presses of a key."""

ASIDE, FARTHEST_ASIDE = 0.012, 0.1
"""How far beside the mark he points, 1 sigma, more after each try; and at most."""

VAIN = 7
"""Places that held nothing to bite, before another tool is tried."""

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
        self._vain = self._waits = self._turned = 0
        self._shots = 0

    def operate(self, sight: Sight) -> None:
        """Do one act of the task."""
        if sight.task != self._task:
            self._task, self._choice = sight.task, 0
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
        person = self._person
        if not mark.is_in or off > 0.47:
            self._follow(mark)
            return
        if not self._is_ready(sight):
            self._point_at(mark)
            person.wait(0.35)
            sight = person.look()
        if self._is_ready(sight):
            # what comes and goes under a hand that moves is not trusted
            person.wait(0.25)
            sight = person.look()
        self._work_at(sight)

    def _renew(self) -> None:
        self._waits = self._turned = self._vain = 0

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
        aside = min(0.004 + ASIDE * self._vain, FARTHEST_ASIDE)
        x = mark.x + person.rng.gauss(0.0, aside)
        y = mark.y + person.rng.gauss(0.0, aside)
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

    def _work_at(self, now: Sight) -> None:
        """Bite where it says that it is worth it; else turn, or try beside it."""
        person = self._person
        if now.mark is None or now.task != self._task:
            return
        if not self._is_ready(now):
            self._vain += 1
            if self._vain > VAIN:
                person.say(f"nothing to bite here: {now.mark.mm:.0f} mm {now.said}")
                self._elsewhere()
                return
            if now.mark.mm > NEAR_MM and "(tool)" not in now.touching:
                person.hand.wheel(2)
            self._turn_to(TURNS[self._vain % len(TURNS)])
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
        assert sight.mark is not None
        if "inject" in self._task.lower():
            near_mm = NEAR_MM if self._vain >= 2 else AT_MM
            return sight.mark.mm <= near_mm
        if sight.hazard_mm < HAZARD_MM:
            return False
        words = f"{sight.mark.words} {self._task}".lower()
        named = {n: v for n, v in sight.bite.items() if n.split()[0] in words}
        spared = [n for n in sight.bite if n not in named and _is_spared(n)]
        if spared:
            return False
        wanted = named if "uncinate" in words or "polyp" in words else sight.bite
        enough = LEAST_MM3 if self._vain >= VAIN // 2 else 2.0 * LEAST_MM3
        return sum(wanted.values()) >= enough

    def _turn_to(self, steps: int) -> None:
        """Turn the wrist from where it is by keys."""
        person = self._person
        left = steps - self._turned
        for _ in range(abs(left)):
            person.hand.tap(Key.Key_Home if left > 0 else Key.Key_End)
            person.wait(0.03)
        self._turned = steps

    def _elsewhere(self) -> None:
        """Try another tool, then from another place of the scope."""
        person = self._person
        self._choice += 1
        self.put_away()
        self._renew()
        if self._choice % 2:
            return
        person.go(-2)
        person.stroke(
            person.rng.uniform(-30.0, 30.0),
            person.rng.uniform(-30.0, 30.0),
            Button.LeftButton,
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
