"""Each moment's signs reach what can be heard and felt, and all of it ends."""

from dataclasses import dataclass, field

from devices.controls.rumble import Rumble
from paravol.feedback.feedback import Feedback
from paravol.feedback.sound import SoundPlayer
from paravol.feedback.tones import Tick
from paravol.feedback.touch_signs import TouchSigns


@dataclass
class Heard(SoundPlayer):
    """Notes what is asked of a loudspeaker."""

    log: list[object] = field(default_factory=list)

    def follow(self, signs: TouchSigns) -> None:
        self.log.append(signs)

    def strike(self, tick: Tick) -> None:
        self.log.append(tick)

    def quiet(self) -> None:
        self.log.append("quiet")

    def close(self) -> None:
        self.log.append("closed")


@dataclass
class Felt(Rumble):
    """Notes what is asked of a pad."""

    log: list[object] = field(default_factory=list)

    def follow(self, strength: float) -> None:
        self.log.append(strength)

    def pulse(self) -> None:
        self.log.append("pulse")

    def stop(self) -> None:
        self.log.append("stop")


def test_a_press_is_heard_and_felt_and_a_break_once() -> None:
    sound, rumble = Heard(), Felt()
    feedback = Feedback(sound, rumble)
    moments = [
        TouchSigns(3.0, "lamella", 6.0),
        TouchSigns(0.0, breaks=1, broken="lamella", broken_n=6.0),
        TouchSigns(0.0, breaks=1, broken="lamella", broken_n=6.0, bites=1),
        TouchSigns(0.0, breaks=1, broken="lamella", broken_n=6.0, bites=1),
    ]
    for signs in moments:
        feedback.follow(signs)
    one, two, three, four = moments
    assert sound.log == [one, two, Tick.BREAK, three, Tick.BITE, four]
    assert rumble.log == [0.5, 0.0, "pulse", 0.0, 0.0]
    feedback.quiet()
    feedback.close()
    assert rumble.log[5:] == ["stop", "stop"]
    assert sound.log[-3:] == ["quiet", "quiet", "closed"]


def test_without_a_pad_there_is_sound_alone() -> None:
    sound = Heard()
    feedback = Feedback(sound, None)
    feedback.follow(TouchSigns(breaks=1))
    feedback.close()
    assert Tick.BREAK in sound.log
