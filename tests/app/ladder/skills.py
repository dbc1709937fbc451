"""What the simulated person knows to do, by the words of the task."""

import math
import time
from collections.abc import Callable

from PySide6.QtCore import Qt

from tests.app.ladder.eyes import Mark, Sight
from tests.app.ladder.person import ALL_DONE, MM_PER_NOTCH, LostError, Person
from tests.app.ladder.surgeon import Surgeon, is_for_tool

MIDDLE = (0.5, 0.5)
WASH_EACH_S = 6.0
STUCK_AFTER = 3
"""Moves ahead that brought nothing, before one draws back and looks elsewhere."""

SURVEYED_MM = 9.0
"""From farther away mucosa that is looked at may not count."""

NICHE_MM = 14.0
"""Who is so near to what he cannot see turns a scope that looks aside."""

STILL, SAME = 0.02, 12
"""What is left to go must become less by so much; so often it may not, before one takes
oneself for stuck."""

KEPT, SHOWN_S = ("Keep away", "Spare"), 1.0
"""What is only to be kept has no end but the flight's, where it stays so long."""

Skill = Callable[["Trainee", Sight], None]


class Trainee:
    """Do the tasks of one exercise, act by act, and remember what was tried."""

    def __init__(self, person: Person, shoot: Callable[[str], None]) -> None:
        """Begin; shoot: keeps a picture of the window under a name."""
        self.person = person
        self._shoot = shoot
        self._tasks = 0
        self._task = ""
        self._words = ""
        self._nearest_mm = math.inf
        self._vain = 0
        self._waited = 0
        self._roll_way = 1.0
        self._level_way = 1.0
        self._touched = False
        self._washed_s = 0.0
        self.surgeon = Surgeon(person, shoot)
        self._least = math.inf
        self._eased = 0
        self._same = self._freed = self._aimed = self._rolled = self._along = 0

    def do_all(self, but_with_tools: bool = False) -> None:
        """Do one task after the other until all are done; LostError if he gives up.

        but_with_tools: only until one is to be done with a tool.
        """
        while True:
            sight = self.person.look()
            if sight.page != "FlightPage":
                raise LostError(f"the window shows {sight.page}")
            if ALL_DONE in sight.task:
                return
            if sight.task.startswith(KEPT):
                # what comes after a task that is done may not stand there yet
                self.person.wait(SHOWN_S)
                sight = self.person.look()
                if sight.task.startswith(KEPT):
                    return
            if "failed" in sight.done:
                raise LostError(sight.done)
            if sight.task != self._task:
                self.person.say(f"now: {sight.task} ({sight.done})")
                self._task = sight.task
                self._forget()
                self._shoot(f"task-{self._tasks}")
                self._tasks += 1
            mark = sight.mark
            self.person.say(
                f"  bar {sight.bar:.2f} mark "
                + (
                    "none"
                    if mark is None
                    else f"{mark.words or 'way'} {mark.mm:.0f} mm at {mark.x:.2f} "
                    f"{mark.y:.2f} {'in' if mark.is_in else 'out'} {mark.back_mm:.0f}"
                )
                + (
                    f" to {sight.heading[0]:.2f} {sight.heading[1]:.2f}"
                    if sight.heading
                    else ""
                )
                + f" {sight.alarm or sight.touching}"
                + (f" {sight.bite} {sight.hazard_mm}" if sight.tool else "")
            )
            if self._wash(sight):
                continue
            if is_for_tool(sight.task):
                if but_with_tools:
                    return
                self.surgeon.operate(sight)
                continue
            self.surgeon.put_away()
            if self._is_stuck(sight):
                self._free()
                continue
            skill_for(sight.task)(self, sight)

    def _forget(self) -> None:
        self._nearest_mm, self._vain, self._waited = math.inf, 0, 0
        self._same, self._freed, self._least = 0, 0, math.inf

    def _is_stuck(self, sight: Sight) -> bool:
        """Tell whether nothing has come nearer for a while, whatever he did."""
        mark, place = sight.mark, sight.heading or MIDDLE
        left = -40.0 * sight.bar
        if mark is not None:
            left += mark.mm / 40.0 + math.hypot(mark.x - place[0], mark.y - place[1])
        if left < self._least - STILL:
            self._least, self._same = left, 0
        self._same += 1
        return self._same > SAME

    def _wash(self, sight: Sight) -> bool:
        """Wash the lens some time after it touched something; tell if he did."""
        if sight.touching or sight.alarm:
            self._touched = True
            return False
        if not self._touched or time.monotonic() < self._washed_s + WASH_EACH_S:
            return False
        self._touched, self._washed_s = False, time.monotonic()
        self.person.hand.tap(Qt.Key.Key_L)
        return True

    # Skills: each does one act

    def hold(self, sight: Sight) -> None:
        """Bring the tip near, then take the hand off."""
        if sight.bar > 0.0:
            self.person.wait(0.3)
        else:
            self.approach(sight)

    def rings(self, sight: Sight) -> None:
        """Aim at the ring, go through; from behind it go back."""
        mark = sight.mark
        if mark is not None and mark.words.startswith("back") and not mark.is_in:
            self.person.go(-3)
            return
        self.approach(sight, finely=True)

    def look_at(self, sight: Sight) -> None:
        """Bring the place into the middle and keep it there."""
        mark = sight.mark
        if "upright" in sight.task and self._level(sight):
            return
        if sight.touching == "wall" and self._eased < 4:
            # the last stroke a part back, then the scope, and once more
            self._eased += 1
            if self._eased % 2:
                self.person.ease()
            else:
                self.person.go(-1)
            return
        was_held, self._eased = self._eased > 0, 0
        if sight.bar > 0.0:
            self.person.wait(0.2)
            return
        if was_held and mark is not None and not mark.is_goal and not mark.back_mm:
            # the same stroke leads to the same wall: on past it first
            self._ahead(mark)
            return
        if mark is None or not mark.is_goal:
            is_near = mark is not None and mark.mm < NICHE_MM
            if mark is not None and is_near and sight.heading and self._same % 3:
                # into a niche one looks from beside it
                self._turn_to(sight, mark)
            else:
                self.approach(sight)
            return
        off = math.hypot(mark.x - 0.5, mark.y - 0.5)
        if mark.is_in and off < 0.05:
            self._change_distance(mark)
        else:
            self.bring(sight, mark)

    def survey(self, sight: Sight) -> None:
        """Look at what is not seen yet, wherever the mark goes."""
        mark = sight.mark
        if mark is None or not mark.is_goal or mark.mm > 25.0:
            self.approach(sight)
            return
        off = math.hypot(mark.x - 0.5, mark.y - 0.5)
        if not mark.is_in or off > 0.25:
            self.bring(sight, mark)
            return
        self._waited += 1
        if self._waited % 3:
            self.person.wait(0.2)
        elif mark.mm > SURVEYED_MM and self._waited < 12:
            # from nearby more counts
            self.person.go(2)
        elif self._waited % 2:
            self.person.roll(self.person.rng.choice((-70.0, 70.0)))
        else:
            self.person.go(-2)

    # Acts

    def bring(self, sight: Sight, mark: Mark) -> None:
        """Turn the scope so that a mark comes to the picture's middle."""
        if sight.heading is None:
            self._tilt_to(MIDDLE, mark)
        else:
            self._turn_to(sight, mark)

    def approach(self, sight: Sight, *, finely: bool = False) -> None:
        """Bring where the shaft goes onto the mark, then go in."""
        mark = sight.mark
        if mark is None:
            self._wander()
            return
        if mark.back_mm > 0.0:
            self.person.go(-min(max(round(mark.back_mm / MM_PER_NOTCH), 1), 6))
            self._nearest_mm = math.inf
            return
        place = MIDDLE if sight.heading is None else sight.heading
        if math.hypot(place[0] - 0.5, place[1] - 0.5) > 0.5:
            place = _rim(place)
            if not mark.is_in:
                # both are arrows at the rim
                off = math.hypot(mark.x - place[0], mark.y - place[1])
                if off > 0.15:
                    self._tilt_to(place, mark)
                else:
                    self._ahead(mark)
                return
        off = math.hypot(mark.x - place[0], mark.y - place[1])
        # far away, a direction will do
        least = 0.12 if mark.mm > 10.0 and not mark.is_goal else 0.08
        if finely:
            # and near a ring little is missed
            least = max(0.04, 0.6 / max(mark.mm, 1.0))
        elif mark.is_in and mark.mm < 8.0:
            least *= 2.0
        # walls may hold the shaft aside: who has aimed twice pushes on
        if off > least and (finely or self._aimed < 2 or off > 0.3):
            self._aimed += 1
            self._tilt_to(place, mark)
        else:
            self._aimed = 0
            self._ahead(mark)

    def _ahead(self, mark: Mark) -> None:
        if mark.words != self._words:
            self._words, self._nearest_mm, self._vain = mark.words, math.inf, 0
        if mark.mm < self._nearest_mm - 0.5:
            self._vain = 0
        else:
            self._vain += 1
        self._nearest_mm = min(self._nearest_mm, mark.mm)
        if self._vain > STUCK_AFTER:
            self._free()
            return
        self.person.go(min(max(round(0.3 * mark.mm / MM_PER_NOTCH), 1), 5))

    def _free(self) -> None:
        """Draw back, and try another way past what is in the way."""
        self._freed += 1
        back = 3 * min(self._freed, 5)
        self.person.say(f"stuck: draws back {back}")
        rng = self.person.rng
        self.person.go(-back)
        self.person.stroke(
            rng.uniform(-90.0, 90.0),
            rng.uniform(-90.0, 90.0),
            Qt.MouseButton.LeftButton,
        )
        self._nearest_mm, self._vain = math.inf, 0
        self._same, self._least = 0, math.inf

    def _wander(self) -> None:
        """Nothing is marked: wait a little, then look round."""
        self._waited += 1
        if self._waited < 12:
            self.person.wait(0.3)
            return
        self._waited = 0
        self._free()

    def _tilt_to(self, place: tuple[float, float], mark: Mark) -> None:
        person = self.person
        error = place[0] - mark.x, place[1] - mark.y
        before = person.eyes.sight.mark
        person.aim(error, mark)
        after = person.eyes.sight.mark
        if before is not None and after is not None:
            moved = math.hypot(after.x - mark.x, after.y - mark.y)
            if moved < 0.1 * math.hypot(*error) and math.hypot(*error) > 0.05:
                self._vain += 1
                if self._vain > 2 * STUCK_AFTER:
                    self._free()
                elif self._vain >= 2 and (after.is_in or not after.is_goal):
                    # a wall holds the shaft: along it one gets on, too
                    person.go(2 if self._vain % 4 else -2)
                return
        self._vain = 0

    def _change_distance(self, mark: Mark) -> None:
        """The place is in the middle and still does not count: too far, or too near."""
        self._waited += 1
        if self._waited < 3:
            self.person.wait(0.25)
            return
        self._waited = 0
        if mark.mm > 12.0:
            self.person.go(2)
        else:
            self.person.go(-1)

    def _turn_to(self, sight: Sight, mark: Mark) -> None:
        """With a scope that looks aside: turn the light post towards the mark."""
        assert sight.heading is not None
        hx, hy = sight.heading
        goal = math.atan2(mark.y - hy, mark.x - hx)
        view = math.atan2(0.5 - hy, 0.5 - hx)
        turn_deg = math.degrees(math.remainder(goal - view, 2.0 * math.pi))
        off = math.hypot(mark.x - 0.5, mark.y - 0.5)
        if abs(turn_deg) > 15.0 and off > 0.12 and self._rolled < 3:
            self._rolled += 1
            asked = max(min(turn_deg, 70.0), -70.0) * self._roll_way
            self.person.roll(asked)
            self._learn_roll(turn_deg)
            return
        self._rolled = 0
        near = math.hypot(mark.x - hx, mark.y - hy)
        own = math.hypot(0.5 - hx, 0.5 - hy)
        if abs(near - own) > 0.08 and self._along < 4:
            # what is passed goes outwards in the picture: no wall is touched so
            self._along += 1
            notches = 2 if abs(near - own) > 0.2 else 1
            self.person.go(-notches if near > own else notches)
            return
        self._along = 0
        self._tilt_to(MIDDLE, mark)

    def _learn_roll(self, before_deg: float) -> None:
        sight = self.person.look()
        if sight.mark is None or sight.heading is None:
            return
        hx, hy = sight.heading
        goal = math.atan2(sight.mark.y - hy, sight.mark.x - hx)
        view = math.atan2(0.5 - hy, 0.5 - hx)
        now_deg = math.degrees(math.remainder(goal - view, 2.0 * math.pi))
        if abs(now_deg) > abs(before_deg) + 8.0 and abs(before_deg) < 110.0:
            self.person.say("the post turns the other way")
            self._roll_way = -self._roll_way

    def _level(self, sight: Sight) -> bool:
        """Turn the camera head until the patient's top is above; tell if it was not."""
        if sight.up is None:
            return False
        off_deg = math.degrees(math.atan2(sight.up[0], -sight.up[1]))
        if abs(off_deg) < 5.0:
            return False
        presses = max(round(abs(off_deg) / 5.0), 1)
        key = (
            Qt.Key.Key_BracketRight
            if off_deg * self._level_way > 0.0
            else Qt.Key.Key_BracketLeft
        )
        for _ in range(presses):
            self.person.hand.tap(key)
            self.person.wait(0.05)
        after = self.person.look().up
        if after is not None:
            now_deg = math.degrees(math.atan2(after[0], -after[1]))
            if abs(now_deg) > abs(off_deg) + 4.0:
                self.person.say("the camera turns the other way")
                self._level_way = -self._level_way
        return True


def look_round(person: Person) -> None:
    """Fly in a head without tasks: go in, look to all sides, come back.

    LostError where neither wheel nor strokes change what is seen.
    """
    cleared = set()
    pictures = person.look().pictures
    for right_px, down_px in ((0, 0), (60, 0), (-120, 0), (60, 60), (0, -120), (0, 60)):
        person.go(3)
        if right_px or down_px:
            person.stroke(right_px, down_px, Qt.MouseButton.LeftButton)
        sight = person.look()
        cleared.add(sight.gauges.get("Clearance", ""))
        person.say(f"  {sight.gauges} {sight.touching}")
    person.go(-18)
    if person.look().pictures < pictures + 3 or len(cleared) < 2:
        raise LostError("the scope does not move")


def _rim(place: tuple[float, float]) -> tuple[float, float]:
    x, y = place[0] - 0.5, place[1] - 0.5
    away = math.hypot(x, y)
    return 0.5 + 0.5 * x / away, 0.5 + 0.5 * y / away


def skill_for(words: str) -> Skill:
    """Return what to do for a task, by what it says."""
    low = words.lower()
    if "hold the tip still" in low:
        return Trainee.hold
    if "rings" in low:
        return Trainee.rings
    if ": see " in low:
        return Trainee.survey
    return Trainee.look_at
