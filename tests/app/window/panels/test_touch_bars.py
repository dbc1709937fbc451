"""Bars of force and nearness, painted; what the sound says of itself."""

import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication

from app.window.flight.view_keys import SoundKeys
from app.window.keyboard.actions import Act
from app.window.panels.touch_bars import TouchBars
from paravol.feedback import SoundPlayer, TouchSigns

WIDTH = 842
"""Two bars of 400 pixels and three sides of 14."""


def painted(signs: TouchSigns, sound: str = "") -> tuple[NDArray[np.int64], str]:
    """Return the pixels of the bars, and what they say to a reader of screens."""
    bars = TouchBars()
    bars.resize(WIDTH, 52)
    bars.show_signs(signs, sound)
    image = bars.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    pixels = rows[:, : 3 * WIDTH].reshape(image.height(), WIDTH, 3)
    return pixels.astype(np.int64), bars.accessibleName()


@pytest.mark.display
def test_a_bar_is_as_long_as_the_force_and_marks_the_break(
    application: QApplication,
) -> None:
    empty, _ = painted(TouchSigns())
    for force in (2.5, 5.0, 7.5, 12.5):
        pixels, _ = painted(TouchSigns(force, "mucosa"))
        changed = np.abs(pixels - empty).max(axis=2)[31:41, 14:414].max(axis=0) > 20
        # 400 pixels for 20 N
        assert np.flatnonzero(changed).max() + 1 == pytest.approx(20 * force, abs=1)
    for limit in (6.0, 12.0):
        pixels, _ = painted(TouchSigns(0.0, "", limit))
        changed = np.abs(pixels - empty).max(axis=2)[44:48, 14:414].max(axis=0) > 60
        assert np.flatnonzero(changed).mean() + 0.5 == pytest.approx(20 * limit, abs=1)


@pytest.mark.display
def test_without_colour_the_looks_of_a_bar_still_differ(
    application: QApplication,
) -> None:
    """Their grey varies along a hatched bar."""
    looks = []
    for force in (2.0, 4.0, 5.8):
        pixels, _ = painted(TouchSigns(force, "lamella", 6.1))
        grey = pixels[31:41, 16 : 14 + int(force * 20) - 4].mean(axis=2)
        looks.append((round(float(grey.mean())), float(grey.std())))
    (low, plain), (high, hatched), (breaking, crossed) = looks
    assert plain < 5 < 15 < hatched
    assert crossed > 15
    assert len({low, high, breaking}) == 3


@pytest.mark.display
def test_the_bars_say_what_they_show(application: QApplication) -> None:
    _, said = painted(TouchSigns(3.0, "lamella", 6.1, ("orbit", 1.24)))
    assert said == "Force 3.0 of 6.1 N, lamella. Hazard 1.2 mm to orbit."
    quiet, _ = painted(TouchSigns(hazard=("orbit", 1.24)))
    told, _ = painted(TouchSigns(hazard=("orbit", 1.24)), "no sound")
    assert (quiet != told).any()


def test_the_sound_is_switched_and_says_so() -> None:
    def refuse() -> None:
        raise OSError("nothing")

    said: list[tuple[str, str]] = []
    sound = SoundPlayer(is_on=False, open_device=refuse)
    keys = SoundKeys(sound, lambda *words: said.append(words))
    commands = keys.commands()
    assert keys.caption == "sound off"
    for act in (Act.SOUND, Act.SOFTER, Act.SOFTER, Act.LOUDER):
        commands[act].press()
    assert (keys.caption, sound.is_on) == ("", True)
    assert sound.volume == pytest.approx(0.9)
    keys.fail("No sound: this machine has no loudspeaker.")
    assert keys.caption == "no sound"
    commands[Act.SOUND].press()
    assert [what for what, _ in said] == [
        *("Sound on", "Volume 90%", "Volume 80%", "Volume 90%"),
        *("No sound", "No sound"),
    ]
    assert said[-1][1] == "this machine has no loudspeaker."
