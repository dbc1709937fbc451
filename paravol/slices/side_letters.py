"""Which side of the patient is where in a picture: R and L, A and P, S and I.

The world is the patient's: x towards the left, y towards the back, z upwards.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SIDES = ("R", "L"), ("A", "P"), ("I", "S")
"""For each axis what lies at its lower and its upper end."""

LEAST_SHARE = 0.35
"""An axis that lies in the picture with less of its length is not lettered."""

TOGETHER_DEG = 30.0
"""Letters so near each other become one word, as on radiographs."""


@dataclass(frozen=True, slots=True)
class SideLetter:
    """What lies towards a rim of a picture.

    letters: one side, or two or three, the one most in the picture first. x, y: where,
    a unit vector from the picture's middle, x to the right and y down.
    """

    letters: str
    x: float
    y: float


def side_letters(
    right: NDArray[np.float64], up: NDArray[np.float64]
) -> tuple[SideLetter, ...]:
    """Return the letters round a picture.

    right, up: of the picture, unit vectors ``(3,)`` in the patient's frame.
    """
    found: list[tuple[float, str, float]] = []
    for axis, (lower, upper) in enumerate(SIDES):
        across, down = float(right[axis]), -float(up[axis])
        length = math.hypot(across, down)
        if length >= LEAST_SHARE:
            found.append((length, upper, math.atan2(down, across)))
            found.append((length, lower, math.atan2(-down, -across)))
    # the same order for both ends of an axis, whatever is rounded
    found.sort(key=lambda each: round(-each[0], 9))
    words: list[tuple[str, float]] = []
    for _, letter, angle in found:
        for place, (word, beside) in enumerate(words):
            apart = math.remainder(angle - beside, 2.0 * math.pi)
            if abs(apart) < math.radians(TOGETHER_DEG):
                words[place] = word + letter, beside
                break
        else:
            words.append((letter, angle))
    return tuple(SideLetter(w, math.cos(angle), math.sin(angle)) for w, angle in words)


def looks_towards(forward: NDArray[np.float64]) -> str:
    """Return the sides that a view looks towards, the most first: ``"PS"``.

    forward: unit vector ``(3,)`` in the patient's frame.
    """
    parts = [
        (abs(float(share)), ends[int(share > 0.0)])
        for share, ends in zip(forward, SIDES, strict=True)
        if abs(float(share)) >= LEAST_SHARE
    ]
    return "".join(letter for _, letter in sorted(parts, reverse=True))


def place_text(place_mm: Iterable[float]) -> str:
    """Return a place in words: how far right or left, front or back, up or down."""
    words = [
        f"{ends[int(value > 0.0)]} {abs(value):.1f}"
        for value, ends in zip(place_mm, SIDES, strict=True)
    ]
    return " · ".join(words) + " mm"
