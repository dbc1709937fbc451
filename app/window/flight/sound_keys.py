"""Commands of the sound: on and off, louder and softer."""

from functools import partial

from app.window.keyboard.actions import Act
from app.window.keyboard.page_commands import Command, Commands, Notify
from app.window.texts import tr
from paravol.feedback import SoundPlayer


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
