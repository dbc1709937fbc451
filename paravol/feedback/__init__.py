"""What stands in for feeling: force and nearness as figures, as sound, as rumble."""

from paravol.feedback.feedback import Feedback
from paravol.feedback.sound import SoundPlayer
from paravol.feedback.touch_signs import NO_SIGNS, Strain, TouchSigns

__all__ = ["NO_SIGNS", "Feedback", "SoundPlayer", "Strain", "TouchSigns"]
