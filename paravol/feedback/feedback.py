"""Pass each moment's signs on to whatever can be heard or felt."""

from devices.controls.rumble import Rumble
from paravol.feedback.sound import SoundPlayer
from paravol.feedback.tones import Tick
from paravol.feedback.touch_signs import NO_SIGNS, TouchSigns


class Feedback:
    """Sound and rumble of one flight.

    sound: plays while the flight is live. rumble: of the pad that steers, None where
    it has none.
    """

    def __init__(self, sound: SoundPlayer, rumble: Rumble | None) -> None:
        self.sound = sound
        self.rumble = rumble
        self._last = NO_SIGNS

    def follow(self, signs: TouchSigns) -> None:
        """Let the newest signs be heard and felt."""
        last, self._last = self._last, signs
        self.sound.follow(signs)
        if signs.breaks > last.breaks:
            self.sound.strike(Tick.BREAK)
        if signs.bites > last.bites:
            self.sound.strike(Tick.BITE)
        if self.rumble is not None:
            self.rumble.follow(signs.share)
            if signs.breaks > last.breaks:
                self.rumble.pulse()

    def quiet(self) -> None:
        """Let nothing be heard or felt until the next signs."""
        self.sound.quiet()
        if self.rumble is not None:
            self.rumble.stop()

    def close(self) -> None:
        """Fall silent for good; harmless when repeated."""
        self.quiet()
        self.sound.close()
