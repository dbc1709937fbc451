"""Tones of force and of nearness to a hazard, as samples.

Nearness sounds like a car's parking sensor: a pure tone in pulses, higher and quicker
the nearer, without a pause at last. A press sounds like a low reed, louder and higher
towards the break. A break and a bite are short ticks, each of its own pitch.

All that changes glides, and phases run on from block to block, so that nothing clicks.
"""

import math
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from paravol.feedback.touch_signs import MARGIN_MM

RATE_HZ = 48_000

HAZARD_HZ = 440.0
"""Pitch at the margin; an octave more at the hazard."""

BEAT_HZ = 1.5, 8.0
"""Pulses a second at the margin and at the hazard."""

STEADY_MM = 1.0, 0.5
"""Between these distances the pauses fill up; nearer, the tone is steady."""

FORCE_HZ = 98.0, 147.0
"""Pitch of the lightest press, and of one that breaks: a fifth."""

REED = (1, 1.0), (3, 1 / 3), (5, 1 / 5)
"""Overtones of a press and their weights: odd ones, as of a clarinet."""

HAZARD_LEVEL, FORCE_LEVEL = 0.3, 0.3
"""Loudest amplitudes. With those of all ticks they come to 1."""

ONSET_MM = 0.3
"""The tone of a hazard comes up over so much of its margin."""

LEVEL_S = 0.02
"""Shortest time in which an amplitude goes from nothing to full."""

PITCH_S = 0.05
"""Shortest time in which a pitch, or a beat, goes through its range."""


class Tick(Enum):
    """Short sounds: pitch in Hz, time in which they decay to 1/e in s, amplitude."""

    BREAK = (1568.0, 0.015, 0.3)
    BITE = (659.0, 0.008, 0.1)


TICK_DECAYS = 8.0
"""A tick is cut off after so many of its decay times: at -70 dB."""


class Cues(NamedTuple):
    """What is to be heard.

    hazard_mm: distance of the nearest hazard, infinite for none. share: of the break
    force, 0 to 1. volume: 0 to 1.
    """

    hazard_mm: float = math.inf
    share: float = 0.0
    volume: float = 1.0


SILENCE = Cues(volume=0.0)


def nearness(distance_mm: float) -> float:
    """Return 0 at the margin and beyond, 1 at the hazard and inside it."""
    if math.isnan(distance_mm):
        return 0.0
    return min(max(1.0 - distance_mm / MARGIN_MM, 0.0), 1.0)


def hazard_pitch_hz(distance_mm: float) -> float:
    """Return the pitch of a hazard: an octave over the margin."""
    return float(HAZARD_HZ * 2.0 ** nearness(distance_mm))


def beat_hz(distance_mm: float) -> float:
    """Return how often a second the tone of a hazard pulses."""
    slow, quick = BEAT_HZ
    return float(slow * (quick / slow) ** nearness(distance_mm))


def steadiness(distance_mm: float) -> float:
    """Return how much of the pauses is filled: 0 for pulses, 1 for a steady tone."""
    begins, ends = STEADY_MM
    if math.isnan(distance_mm):
        return 0.0
    return min(max((begins - distance_mm) / (begins - ends), 0.0), 1.0)


def hazard_level(distance_mm: float) -> float:
    """Return the amplitude of a hazard's tone: nothing from the margin on."""
    return HAZARD_LEVEL * min(nearness(distance_mm) * MARGIN_MM / ONSET_MM, 1.0)


def force_pitch_hz(share: float) -> float:
    """Return the pitch of a press of this share of the break force."""
    low, high = FORCE_HZ
    return low + (high - low) * share


def force_level(share: float) -> float:
    """Return the amplitude of a press of this share of the break force."""
    return FORCE_LEVEL * share


def pulse(beat: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the envelope of a pulse by the phase of its beat, in turns.

    sin^2 over the first half of a beat, nothing over the second.
    """
    turn = beat % 1.0
    found: NDArray[np.float64] = np.where(
        turn < 0.5, np.sin(2.0 * math.pi * turn) ** 2, 0.0
    )
    return found


def tick_samples(tick: Tick, first: int, count: int) -> NDArray[np.float64]:
    """Return samples of a tick from its `first` on: sin(2 pi f t) exp(-t / decay)."""
    pitch_hz, decay_s, level = tick.value
    time_s = np.arange(first, first + count) / RATE_HZ
    heard = time_s < TICK_DECAYS * decay_s
    wave = np.sin(2.0 * math.pi * pitch_hz * time_s) * np.exp(-time_s / decay_s)
    return np.asarray(np.where(heard, level * wave, 0.0), dtype=np.float64)


@dataclass(slots=True)
class _Glide:
    """Follow a target, changing by at most `step` a sample."""

    value: float
    step: float

    def run(self, target: float, count: int) -> NDArray[np.float64]:
        """Return the next values, ``(count,)``."""
        way = target - self.value
        moved = np.minimum(np.arange(1, count + 1) * self.step, abs(way))
        values = self.value + math.copysign(1.0, way) * moved
        if abs(way) <= count * self.step:
            # exactly there: what has died away is silence, not rounding
            values[moved == abs(way)] = target
        self.value = float(values[-1])
        return np.asarray(values, dtype=np.float64)


def _step(span: float, time_s: float) -> float:
    return span / (time_s * RATE_HZ)


@dataclass(slots=True)
class _Phase:
    """Add up a frequency to a phase, in turns."""

    turns: float = 0.0

    def run(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the next phases, ``(count,)``."""
        phases = self.turns + np.cumsum(frequency_hz) / RATE_HZ
        self.turns = float(phases[-1] % 1.0)
        return np.asarray(phases, dtype=np.float64)


class Synthesizer:
    """Turn cues into samples, block by block.

    The samples depend on the cues and on when they changed, not on how the time is cut
    into blocks. No sample exceeds the volume.
    """

    def __init__(self) -> None:
        self._volume = _Glide(0.0, _step(1.0, LEVEL_S))
        self._hazard = _Glide(0.0, _step(HAZARD_LEVEL, LEVEL_S))
        self._hazard_hz = _Glide(HAZARD_HZ, _step(HAZARD_HZ, PITCH_S))
        self._beat_hz = _Glide(BEAT_HZ[0], _step(BEAT_HZ[1], PITCH_S))
        self._steady = _Glide(0.0, _step(1.0, LEVEL_S))
        self._force = _Glide(0.0, _step(FORCE_LEVEL, LEVEL_S))
        low_hz, high_hz = FORCE_HZ
        self._force_hz = _Glide(low_hz, _step(high_hz - low_hz, PITCH_S))
        self._tone, self._beat, self._reed = _Phase(), _Phase(), _Phase()
        self._ticks: dict[Tick, int] = {}

    def strike(self, tick: Tick) -> None:
        """Begin a tick with the next block; one that still sounds is left alone."""
        self._ticks.setdefault(tick, 0)

    def block(self, count: int, cues: Cues) -> NDArray[np.float32]:
        """Return the next samples, ``(count,)`` float32 at `RATE_HZ`, -1 to 1."""
        if count <= 0:
            return np.zeros(0, dtype=np.float32)
        distance_mm = cues.hazard_mm
        share = min(max(cues.share, 0.0), 1.0) if math.isfinite(cues.share) else 0.0
        steady = self._steady.run(steadiness(distance_mm), count)
        beat = self._beat.run(self._beat_hz.run(beat_hz(distance_mm), count))
        gate = steady + (1.0 - steady) * pulse(beat)
        tone = self._tone.run(self._hazard_hz.run(hazard_pitch_hz(distance_mm), count))
        level = self._hazard.run(hazard_level(distance_mm), count)
        samples = level * gate * np.sin(2.0 * math.pi * tone)
        reed = self._reed.run(self._force_hz.run(force_pitch_hz(share), count))
        level = self._force.run(force_level(share), count)
        loudest = sum(weight for _, weight in REED)
        for overtone, weight in REED:
            wave = np.sin(2.0 * math.pi * overtone * reed)
            samples += level * (weight / loudest) * wave
        for tick, age in list(self._ticks.items()):
            samples += tick_samples(tick, age, count)
            self._ticks[tick] = age + count
            if age + count >= TICK_DECAYS * tick.value[1] * RATE_HZ:
                del self._ticks[tick]
        samples *= self._volume.run(min(max(cues.volume, 0.0), 1.0), count)
        return samples.astype(np.float32)
