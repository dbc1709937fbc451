"""Tones of force and nearness: pitches in closed form, no clicks, bounded loudness."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from paravol.feedback.tones import (
    BEAT_HZ,
    FORCE_HZ,
    FORCE_LEVEL,
    HAZARD_HZ,
    HAZARD_LEVEL,
    LEVEL_S,
    RATE_HZ,
    REED,
    TICK_DECAYS,
    Cues,
    Synthesizer,
    Tick,
    beat_hz,
    hazard_level,
    hazard_pitch_hz,
    pulse,
    steadiness,
    tick_samples,
)
from paravol.feedback.touch_signs import MARGIN_MM

distances = st.one_of(st.just(math.inf), st.just(math.nan), st.floats(-5.0, 10.0))
cues = st.builds(Cues, distances, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
played = st.lists(
    st.tuples(st.integers(1, 3000), cues, st.sampled_from([None, *Tick])),
    min_size=1,
    max_size=8,
)

STEEPEST = (
    # a tone's slope, the slope of its pulses (sin^2 over half a beat), the reed's
    2.0 * math.pi * 2.0 * HAZARD_HZ * HAZARD_LEVEL
    + 2.0 * math.pi * BEAT_HZ[1] * HAZARD_LEVEL
    + 2.0 * math.pi * FORCE_HZ[1] * FORCE_LEVEL * len(REED)
    + sum(tick.value[2] * 2.0 * math.pi * tick.value[0] for tick in Tick)
)
"""The steepest slope of all tones together, per second, while nothing glides."""


def settled(now: Cues) -> Synthesizer:
    """Play long enough for every glide to arrive."""
    synthesizer = Synthesizer()
    synthesizer.block(RATE_HZ // 5, now)
    return synthesizer


def pitch_of(samples: NDArray[np.float32]) -> float:
    """The pitch that a pure tone has, by its zero crossings, interpolated."""
    below = np.flatnonzero((samples[:-1] < 0.0) & (samples[1:] >= 0.0))
    at = below + samples[below] / (samples[below] - samples[below + 1])
    return float((len(at) - 1) / (at[-1] - at[0]) * RATE_HZ)


@pytest.mark.parametrize("distance_mm", [0.5, 0.25, 0.0, -1.0])
def test_next_to_a_hazard_a_steady_sine_has_the_pitch_of_the_distance(
    distance_mm: float,
) -> None:
    samples = settled(Cues(distance_mm)).block(RATE_HZ // 2, Cues(distance_mm))
    share = min(1.0 - distance_mm / MARGIN_MM, 1.0)
    assert pitch_of(samples) == pytest.approx(HAZARD_HZ * 2.0**share, rel=1e-5)
    assert samples.max() == pytest.approx(HAZARD_LEVEL, rel=1e-3)
    # a sine and nothing else: its square is level^2 / 2
    power = np.square(samples.astype(np.float64)).mean()
    assert power == pytest.approx(HAZARD_LEVEL**2 / 2.0, rel=2e-3)


@pytest.mark.parametrize("distance_mm", [2.5, 1.5, 1.0])
def test_farther_off_it_pulses_as_often_as_the_distance_says(
    distance_mm: float,
) -> None:
    seconds = 4
    samples = settled(Cues(distance_mm)).block(seconds * RATE_HZ, Cues(distance_mm))
    # half of every beat is silence: count where sound begins
    loud = np.abs(samples).reshape(-1, RATE_HZ // 200).max(axis=1) > 0.02
    begun = int(np.count_nonzero(loud[1:] & ~loud[:-1]))
    assert begun == pytest.approx(seconds * beat_hz(distance_mm), abs=1.0)


@given(st.floats(-5.0, 10.0), st.floats(-5.0, 10.0))
def test_nearer_is_never_lower_slower_or_softer(one: float, other: float) -> None:
    near, far = sorted((one, other))
    for rises in (hazard_pitch_hz, beat_hz, steadiness, hazard_level):
        assert rises(near) >= rises(far)


def test_beyond_the_margin_and_without_a_press_is_exact_silence() -> None:
    synthesizer = settled(Cues(1.0, 0.7))
    quiet = Cues(MARGIN_MM, 0.0)
    synthesizer.block(math.ceil(LEVEL_S * RATE_HZ) + 1, quiet)
    assert not synthesizer.block(4800, quiet).any()
    synthesizer = settled(Cues(0.0, 1.0))
    muted = Cues(0.0, 1.0, volume=0.0)
    synthesizer.block(math.ceil(LEVEL_S * RATE_HZ) + 1, muted)
    assert not synthesizer.block(4800, muted).any()


@pytest.mark.parametrize("share", [0.2, 0.6, 1.0])
def test_a_press_is_a_reed_whose_overtones_are_the_odd_ones(share: float) -> None:
    samples = settled(Cues(share=share)).block(RATE_HZ, Cues(share=share))
    window = np.hanning(RATE_HZ)
    found = np.abs(np.fft.rfft(samples * window)) * 2.0 / window.sum()
    pitch = FORCE_HZ[0] + (FORCE_HZ[1] - FORCE_HZ[0]) * share
    whole = sum(weight for _, weight in REED)
    for overtone, weight in REED:
        near = found[round(overtone * pitch) - 3 : round(overtone * pitch) + 4]
        expected = FORCE_LEVEL * share * weight / whole
        assert near.max() == pytest.approx(expected, rel=0.16)  # between two bins
        # hence energy: a Hann window spreads a line over bins by 1.5
        energy = math.sqrt(np.square(near).sum() / 1.5)
        assert energy == pytest.approx(expected, rel=1e-3)
    even = found[round(2 * pitch) - 3 : round(2 * pitch) + 4]
    assert even.max() < 1e-4


@settings(max_examples=60, deadline=None)
@given(played)
def test_nothing_clicks_whatever_is_played(
    sequence: list[tuple[int, Cues, Tick | None]],
) -> None:
    synthesizer, blocks = Synthesizer(), [np.zeros(1)]
    for count, now, tick in sequence:
        if tick is not None:
            synthesizer.strike(tick)
        blocks.append(synthesizer.block(count, now).astype(np.float64))
    samples = np.concatenate(blocks)
    # levels, gate and volume each glide over their range in LEVEL_S at the quickest
    gliding = (HAZARD_LEVEL * 2 + FORCE_LEVEL + 1.0) / LEVEL_S
    assert np.abs(np.diff(samples)).max() <= (STEEPEST + gliding) / RATE_HZ
    assert np.abs(samples).max() <= 1.0


@settings(max_examples=60, deadline=None)
@given(
    played, st.floats(0.0, 1.0), st.lists(st.integers(1, 3000), min_size=0, max_size=6)
)
def test_samples_depend_not_on_how_time_is_cut_into_blocks(
    sequence: list[tuple[int, Cues, Tick | None]], volume: float, cuts: list[int]
) -> None:
    whole, parts = Synthesizer(), Synthesizer()
    for count, cue, tick in sequence:
        now = cue._replace(volume=volume)
        for synthesizer in (whole, parts):
            if tick is not None:
                synthesizer.strike(tick)
        expected = whole.block(count, now)
        assert np.abs(expected).max() <= volume
        got, left = [], count
        for cut in (*cuts, count):
            got.append(parts.block(min(cut, left), now))
            left -= len(got[-1])
        assert np.concatenate(got) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("tick", Tick)
def test_a_tick_is_a_damped_sine_and_ends(tick: Tick) -> None:
    pitch_hz, decay_s, level = tick.value
    synthesizer = Synthesizer()
    synthesizer.block(RATE_HZ, Cues())
    synthesizer.strike(tick)
    synthesizer.strike(tick)  # while it sounds, once is enough
    samples = synthesizer.block(RATE_HZ // 2, Cues())
    time_s = np.arange(len(samples)) / RATE_HZ
    wave = level * np.sin(2 * math.pi * pitch_hz * time_s) * np.exp(-time_s / decay_s)
    assert samples == pytest.approx(wave, abs=level * math.exp(-TICK_DECAYS))
    assert samples[0] == 0.0
    assert not synthesizer.block(4800, Cues()).any()
    assert not tick_samples(tick, RATE_HZ, 100).any()


def test_all_levels_come_to_one() -> None:
    ticks = sum(level for _, _, level in (tick.value for tick in Tick))
    assert HAZARD_LEVEL + FORCE_LEVEL + ticks == pytest.approx(1.0)
    beat = np.linspace(0.0, 3.0, 1000)
    assert 0.0 <= pulse(beat).min() <= pulse(beat).max() <= 1.0


def test_no_samples_are_asked_for_and_none_come() -> None:
    assert Synthesizer().block(0, Cues()).shape == (0,)
