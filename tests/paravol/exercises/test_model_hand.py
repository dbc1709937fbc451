"""What a hand did is a path that plays the same; what goes wrong is taken back."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.gallery.gallery_views import operated_samples
from devices import load_probe_path, save_probe_path
from paravol.exercises.recorded_scenario import path_of
from scenarios import Endoscope, InstrumentState, Sample, tip_frame
from scenarios.instrument_state import EMPTY_HAND, NO_TOOL

RATE_HZ = 50.0


def done() -> list[Sample]:
    """Return three seconds: a needle, an empty hand, forceps, another scope."""
    random, samples = np.random.default_rng(3), []
    for n in range(150):
        share = n / 149.0
        state = EMPTY_HAND
        if n < 40:
            state = InstrumentState("injection needle", 170.0 + n, 1.0, n > 20)
        elif n >= 90:
            state = InstrumentState("straight forceps", -120.0 + n / 2, 1.0 - share)
        way = np.array([0.1 * share, 1.0, 0.2])
        way /= np.linalg.norm(way)
        samples.append(
            Sample(
                round(n / RATE_HZ, 4),
                tip_frame((random.normal(size=3) + 30.0 * share).round(4), way),
                round(40.0 * share, 3),
                (random.normal(size=3) - 30.0 * share).round(4),
                way,
                0,
                replace(state, jaw=round(state.jaw, 4)),
                scope_deg=70.0 if n >= 120 else None,
            )
        )
    return samples


def test_a_file_of_what_a_hand_did_plays_the_same(tmp_path: Path) -> None:
    samples = done()
    path = path_of("it", "a test", samples, np.eye(4))
    save_probe_path(path, tmp_path / "it.path.json")
    path = load_probe_path(tmp_path / "it.path.json")
    played = list(operated_samples(path, Endoscope(angle_deg=30.0)))
    assert len(played) == len(samples)
    for did, plays in zip(samples, played, strict=True):
        assert plays.time_s == did.time_s
        assert plays.instrument.name == did.instrument.name
        assert plays.instrument.is_working == did.instrument.is_working
        assert plays.scope_deg == did.scope_deg
        np.testing.assert_allclose(
            plays.device_from_tip, did.device_from_tip, atol=1e-5
        )
        np.testing.assert_allclose(plays.instrument_tip_mm, did.instrument_tip_mm)
        assert abs(plays.roll_deg - did.roll_deg) < 1e-9
        if did.instrument.name != NO_TOOL:
            turn = plays.instrument.roll_deg - did.instrument.roll_deg
            assert abs(math.remainder(turn, 360.0)) < 1e-3
            # a pedal closes jaws as well
            assert plays.instrument.jaw >= did.instrument.jaw
