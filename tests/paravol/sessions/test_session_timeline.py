"""A recording shows at any time what stepping from its beginning shows then."""

import json
import threading
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image
from xxhash import xxh3_128

from app.cli.replay_command import run_at
from app.cli.replay_options import ReplayOptions
from paravol.patient import PatientScene
from paravol.sessions import keyframes, session_pictures
from paravol.sessions.keyframes import (
    APART_S,
    Keyframes,
    load_keyframes,
    save_keyframes,
)
from paravol.sessions.session_timeline import GRACE_S, SessionTimeline
from scenarios import Sample, Session, load_scenario
from system import UserError
from system.object_file import save_objects
from tests.paravol.operated_head import head_round_an_orbit
from tests.recorded_flight import Flight, shaving

EVERY_S = 0.1
COUNT = 160
SIZE = 32
SHOWN = 77
"""Number of the sample that a frame was recorded of."""


@dataclass(frozen=True)
class Flown:
    """A recorded operation, and what each of its samples left.

    picture: of the sample `SHOWN`, as it was drawn live.
    """

    folder: Path
    patient: PatientScene
    samples: list[Sample]
    states: list[str]
    picture: NDArray[np.uint8]


def state_of(session: Session, sample: Sample) -> str:
    """All that anybody can ask of a session after a sample."""
    operation = session.operation
    assert operation is not None
    assert operation.lens is not None
    operation.show()
    patient, seen = operation.patient, session.view(sample)
    return repr(
        (
            patient.hash(),
            xxh3_128(operation.pushing.surface.distance.values.data).hexdigest(),
            patient.wounds_film.tobytes().strip(b"\0"),
            operation.film.hash(),
            operation.lens.state,
            asdict(session.score()),
            seen.clearance_mm,
            seen.world_from_tip.tolist(),
        )
    )


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Flown:
    folder = tmp_path_factory.mktemp("recorded") / "flight.paravol"
    scenario, _ = load_scenario("first_flight")
    patient = head_round_an_orbit(scenario)
    centre = patient.scene.volume.center_mm
    made = Flight(scenario, patient, size=SIZE)
    samples, states = [], []
    with made.recorded(folder):
        for n in range(COUNT):
            undone, washed = n // 40, n // 70
            sample = shaving(n, centre, every_s=EVERY_S, undone=undone, washed=washed)
            made.step(sample)
            samples.append(sample)
            states.append(state_of(made.session, sample))
            if n == SHOWN:
                frame = made.show(SIZE, 0.0, gain=2.5)
    score = made.session.score().operation
    assert score is not None
    assert score.edits > 20
    assert score.bled_ml > 0
    assert score.injuries
    assert len(set(states)) == COUNT
    return Flown(folder, patient, samples, states, frame.pixels)


@pytest.fixture(scope="module")
def timeline(flight: Flown) -> SessionTimeline:
    """One for all examples, so that each begins where the last one ended."""
    return SessionTimeline(flight.folder, flight.patient)


times = st.floats(0.0, (COUNT - 1) * EVERY_S + GRACE_S)


@settings(max_examples=10)
@given(jumps=st.lists(times, min_size=1, max_size=5))
def test_jumps_give_what_stepping_gives(
    flight: Flown, timeline: SessionTimeline, jumps: list[float]
) -> None:
    """To the bit, wherever one comes from; and a jump back steps few samples."""
    distance = timeline.patient.surface.distance.values
    operation = timeline.session.operation
    assert operation is not None
    generation, last_s = operation.patient.generation, -1.0
    for time_s in jumps:
        number = max(n for n in range(COUNT) if flight.samples[n].time_s <= time_s)
        was, steps = distance.copy(), timeline.steps
        sample, changes = timeline.go_to(time_s)
        assert sample.time_s == flight.samples[number].time_s
        assert state_of(timeline.session, sample) == flight.states[number]
        if sample.time_s < last_s:
            assert timeline.steps - steps <= round(APART_S / EVERY_S)
        last_s = sample.time_s
        told = np.zeros(distance.shape, np.bool_)
        for change in changes:
            assert change.generation > generation
            generation = change.generation
            here = tuple(slice(change.low[a], change.high[a] + 1) for a in (2, 1, 0))
            told[here] = True
        assert told[distance != was].all()


def test_keyframes_grow_sparse(flight: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    """However much memory they would need; what they give stays exact."""
    monkeypatch.setattr(keyframes, "MOST_BYTES", 1 << 18)
    monkeypatch.setattr(keyframes, "APART_S", 0.5)
    timeline = SessionTimeline(flight.folder, flight.patient)
    timeline.go_to(timeline.end_s)
    assert timeline.steps == COUNT
    assert 2 <= len(timeline.keyframes.kept) < 16
    for number in (120, 3, 60, 150, 0):
        sample, _ = timeline.go_to(flight.samples[number].time_s)
        assert state_of(timeline.session, sample) == flight.states[number]


def test_kept_keyframes_lead_anywhere_at_once(
    flight: Flown, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Those of one process in the next: the same states, by a few steps."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = SessionTimeline(flight.folder, flight.patient)
    first.go_to(first.end_s)
    save_keyframes(flight.folder, flight.patient, first.keyframes)
    known = load_keyframes(flight.folder, flight.patient)
    assert known.until_s == first.keyframes.until_s > first.end_s - APART_S
    timeline = SessionTimeline(flight.folder, flight.patient, keyframes=known)
    for number in (159, 120, 3, 60, 150, 0):
        steps = timeline.steps
        sample, _ = timeline.go_to(flight.samples[number].time_s)
        assert timeline.steps - steps <= round(APART_S / EVERY_S)
        assert state_of(timeline.session, sample) == flight.states[number]
    # of another patient, or damaged, there are none
    other = replace(flight.patient, hazards=None)
    assert not load_keyframes(flight.folder, other).kept
    (file,) = tmp_path.rglob("*.keyframes")
    file.write_bytes(file.read_bytes()[:-50])
    assert not load_keyframes(flight.folder, flight.patient).kept
    save_objects(file, ["something else"])
    assert not load_keyframes(flight.folder, flight.patient).kept


def test_keyframes_that_cannot_be_kept_harm_nothing(
    flight: Flown, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Neither a cache folder that refuses, nor a state that no file keeps."""
    timeline = SessionTimeline(flight.folder, flight.patient)
    place = tmp_path / "no folder"
    place.write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(place))
    save_keyframes(flight.folder, flight.patient, timeline.keyframes)
    assert not load_keyframes(flight.folder, flight.patient).kept
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (first,) = timeline.keyframes.kept
    circle: list[object] = []
    circle.append(circle)
    for foreign in (threading.Lock(), np.random.default_rng(1), circle, 1 << 70):
        state = replace(first.state, coverage=cast(Any, foreign))
        save_keyframes(
            flight.folder, flight.patient, Keyframes([replace(first, state=state)])
        )
        assert not load_keyframes(flight.folder, flight.patient).kept
    assert not list(tmp_path.rglob("*.keyframes"))


@pytest.mark.parametrize("time_s", [-0.1, COUNT * EVERY_S + GRACE_S, float("nan")])
def test_there_is_nothing_outside(flight: Flown, time_s: float) -> None:
    timeline = SessionTimeline(flight.folder, flight.patient)
    with pytest.raises(UserError, match=r"lasts from 0\.0 to 15\.9 s and has nothing"):
        timeline.go_to(time_s)


def test_a_moment_is_told_and_drawn(
    flight: Flown,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """As it was drawn live, to the bit."""
    monkeypatch.setattr(session_pictures, "load_patient", lambda *_: flight.patient)
    monkeypatch.setenv("COLUMNS", "160")
    out, time_s = tmp_path / "then.png", flight.samples[SHOWN].time_s + 0.01
    options = ReplayOptions(picture=out, threads=1)
    run_at(flight.folder, time_s, options, as_json=False)
    assert np.array_equal(np.asarray(Image.open(out)), flight.picture)
    said = capsys.readouterr().out
    for words in ("tissue removed", "blood", "injury: orbit", str(out)):
        assert words in said
    run_at(flight.folder, time_s, ReplayOptions(threads=1), as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["time_s"] == flight.samples[SHOWN].time_s
    timeline = SessionTimeline(flight.folder, flight.patient)
    timeline.go_to(time_s)
    assert told["score"] == json.loads(json.dumps(asdict(timeline.score())))
