"""Commands of what is seen and heard: which scope is in hand, the sound, the slices."""

from collections.abc import Callable
from functools import partial

from app.window.keyboard.actions import Act
from app.window.keyboard.page_commands import Command, Commands, Notify
from app.window.panels.slices_panel import SlicesView
from app.window.texts import tr
from paravol.feedback import SoundPlayer
from paravol.inputs.scope_in_hand import ScopeInHand

WINDOW_STEP_HU = 50.0
PLACE_STEP = 2.0
"""Voxels of a key that moves the place."""


class ScopeKeys:
    """Put in another scope, and say what it is for."""

    def __init__(self, scopes: ScopeInHand, notify: Notify) -> None:
        self._scopes = scopes
        self._notify = notify

    @property
    def choices_deg(self) -> tuple[float, ...]:
        """Return the angles of all that may be put in."""
        return self._scopes.choices_deg

    def commands(self) -> Commands:
        """Return what can be done."""
        return {
            Act.NEXT_SCOPE: Command(partial(self._step, 1)),
            Act.PREVIOUS_SCOPE: Command(partial(self._step, -1)),
        }

    def take(self, angle_deg: float) -> None:
        """Put in the scope of an angle."""
        self._scopes.choose(angle_deg)
        self._tell(angle_deg)

    def _step(self, step: int) -> None:
        if len(self._scopes.choices_deg) > 1:
            self._tell(self._scopes.step(step))
        else:
            self._notify(
                tr("There is no other scope"), tr("The exercise allows one only.")
            )

    def _tell(self, angle_deg: float) -> None:
        self._notify(
            tr("Scope of {angle_deg:g}°", angle_deg=angle_deg), scope_use(angle_deg)
        )


def scope_use(angle_deg: float) -> str:
    """Return where a scope of an angle looks, in words."""
    if angle_deg == 0.0:
        return tr("It looks straight ahead.")
    return tr(
        "It looks {angle_deg:g}° aside, towards the light post.", angle_deg=angle_deg
    )


class SoundKeys:
    """Switch the loudspeaker, and say what it does."""

    def __init__(self, sound: SoundPlayer, notify: Notify) -> None:
        self._sound = sound
        self._notify = notify
        self._problem = ""

    def fail(self, problem: str) -> None:
        """Say why there is no sound, once; later only who asks for it is told."""
        self._problem = problem
        what, _, why = problem.partition(": ")
        self._notify(what, why)

    @property
    def is_on(self) -> bool:
        """Return whether there is something to be heard."""
        return self._sound.is_on and not self._problem

    @property
    def caption(self) -> str:
        """Return what to say of the sound beside what it tells of."""
        if self._problem:
            return tr("no sound")
        return "" if self._sound.is_on else tr("sound off")

    def commands(self) -> Commands:
        """Return what can be done."""
        return {
            Act.SOUND: Command(self._switch),
            Act.LOUDER: Command(partial(self._step, 1), repeats=True),
            Act.SOFTER: Command(partial(self._step, -1), repeats=True),
        }

    def _switch(self) -> None:
        if self._problem:
            self.fail(self._problem)
            return
        self._notify(
            tr("Sound on") if self._sound.switch() else tr("Sound off"),
            tr("High and quick: a hazard is near. Low: force."),
        )

    def _step(self, steps: int) -> None:
        volume = self._sound.louder(steps)
        self._notify(tr("Volume {volume:.0%}", volume=volume), "")


def slice_commands(slices: SlicesView, notify: Notify) -> Commands:
    """Return what can be done with the slices."""

    def grey(wider_hu: float, brighter_hu: float) -> None:
        notify(slices.change_window(wider_hu, brighter_hu), "")

    def again(do: Callable[..., object], *how: float) -> Command:
        return Command(partial(do, *how), repeats=True)

    return {
        Act.IMAGING: Command(lambda: notify(slices.switch(), tr("Slices at the tip"))),
        Act.FOLLOW: Command(lambda: notify(slices.switch_following(), slices.info)),
        Act.PLANE: Command(
            lambda: notify(slices.next_plane(), tr("Keys go through these slices."))
        ),
        Act.WINDOW: Command(lambda: notify(slices.next_window(), "")),
        Act.SLICE_AHEAD: again(slices.step, 1),
        Act.SLICE_BACK: again(slices.step, -1),
        Act.NARROW: again(grey, -WINDOW_STEP_HU, 0.0),
        Act.WIDE: again(grey, WINDOW_STEP_HU, 0.0),
        Act.BRIGHTER: again(grey, 0.0, WINDOW_STEP_HU / 2),
        Act.DARKER: again(grey, 0.0, -WINDOW_STEP_HU / 2),
        Act.PLACE_LEFT: again(slices.nudge, -PLACE_STEP, 0.0),
        Act.PLACE_RIGHT: again(slices.nudge, PLACE_STEP, 0.0),
        Act.PLACE_UP: again(slices.nudge, 0.0, -PLACE_STEP),
        Act.PLACE_DOWN: again(slices.nudge, 0.0, PLACE_STEP),
    }
