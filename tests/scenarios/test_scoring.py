import itertools
import json

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.scoring.score_table import clearance
from scenarios import Score, Scorer


def test_the_score_of_nothing_can_be_written_and_read_again() -> None:
    """Of a flight that was frozen from its beginning to its end."""
    score = Scorer({"center": np.zeros(3)}).score()
    text = json.dumps(msgspec.to_builtins(score), allow_nan=False)
    assert msgspec.json.decode(text, type=Score) == score
    assert clearance(score) == "unknown"


@given(st.integers(2, 120), st.floats(12.0, 20.0))
def test_length_of_a_circle(count: int, radius: float) -> None:
    scorer = Scorer({"center": np.zeros(3)})
    for i in range(count + 1):
        a = 2 * np.pi * i / count
        scorer.add(i * 0.01, radius * np.array([np.cos(a), np.sin(a), 0.0]), 1.0)
    score = scorer.score()
    assert score.path_length_mm == pytest.approx(
        2 * count * radius * np.sin(np.pi / count)
    )
    assert score.target_distance_mm["center"] == pytest.approx(radius)
    assert score.duration_s == pytest.approx(count * 0.01)


@given(st.floats(0.001, 0.2), st.integers(0, 99))
def test_jitter_adds_little_to_the_length(sigma: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    scorer = Scorer({})
    for i in range(1001):
        tip = np.array([i * 0.1, 0.0, 0.0]) + random.normal(0, sigma / 3**0.5, 3)
        scorer.add(i * 0.01, tip, 1.0)
    # 100 mm of true way; each of at most 200 counted steps is too long by the
    # jitter across it, sigma^2 / step
    assert scorer.score().path_length_mm == pytest.approx(
        100.0, abs=1.0 + 2 * 200 * sigma**2 / 0.5
    )


@given(st.lists(st.floats(-2, 2), min_size=1, max_size=60))
def test_contacts_are_the_runs_of_negative_gaps(gaps: list[float]) -> None:
    scorer = Scorer({})
    for i, gap in enumerate(gaps):
        scorer.add(float(i), np.zeros(3), gap)
    touching = [False, *(g < 0 for g in gaps)]
    runs = sum(b and not a for a, b in itertools.pairwise(touching))
    score = scorer.score()
    assert score.contacts == runs
    assert score.min_clearance_mm == min(gaps)


def test_time_must_not_run_backwards() -> None:
    scorer = Scorer({})
    scorer.add(1.0, np.zeros(3), 1.0)
    with pytest.raises(ValueError, match="order of time"):
        scorer.add(0.5, np.zeros(3), 1.0)


@given(st.floats(0.6, 60.0), st.floats(-90.0, 90.0))
def test_where_a_device_comes_back_is_no_part_of_the_path(
    away_s: float, aside_mm: float
) -> None:
    scorer = Scorer({})
    for i in range(11):
        scorer.add(i * 0.01, np.array([float(i), 0.0, 0.0]), 1.0)
    for i in range(11):
        tip = np.array([float(i), aside_mm, 0.0])
        scorer.add(0.1 + away_s + i * 0.01, tip, 1.0)
    score = scorer.score()
    assert score.path_length_mm == pytest.approx(20.0)
    assert score.duration_s == pytest.approx(away_s + 0.2)


def flown(gaps: list[tuple[float, str]], step_s: float = 0.01) -> Score:
    scorer = Scorer({})
    for i, (gap, structure) in enumerate(gaps):
        scorer.add(i * step_s, np.zeros(3), gap, structure)
    return scorer.score()


def test_one_long_contact_tells_how_long_how_deep_and_where() -> None:
    """A scope that leans on tissue for 30 of 38 s has one contact, and a long one."""
    score = flown(
        [(1.0, "")] * 400
        + [(-0.1, "septum")] * 1000
        + [(-0.5, "middle turbinate")] * 2000
        + [(1.0, "")] * 401
    )
    assert score.contacts == 1
    assert score.duration_s == pytest.approx(38.0)
    assert score.contact_s == pytest.approx(30.0)
    assert score.pressure_s == pytest.approx(20.0)
    assert score.worst_depth_mm == 0.5
    assert score.worst_structure == "middle turbinate"
    assert score.touched_s == pytest.approx({"septum": 10.0, "middle turbinate": 20.0})


def test_a_flight_without_contact_names_nothing() -> None:
    score = flown([(0.0, ""), (1.0, "")])
    assert (score.contacts, score.contact_s, score.pressure_s) == (0, 0.0, 0.0)
    assert (score.worst_depth_mm, score.worst_structure) == (0.0, "")
    assert score.touched_s == {}


@given(
    st.lists(
        st.tuples(st.floats(-2, 2), st.sampled_from("abc")), min_size=2, max_size=60
    )
)
def test_times_of_structures_add_up_to_the_contact(
    gaps: list[tuple[float, str]],
) -> None:
    score = flown(gaps)
    assert sum(score.touched_s.values()) == pytest.approx(score.contact_s)
    assert score.pressure_s <= score.contact_s <= score.duration_s
    assert score.worst_depth_mm == max(0.0, -score.min_clearance_mm)
    assert set(score.touched_s) == {name for gap, name in gaps if gap < 0}


def test_nobody_knows_a_contact_while_the_device_was_away() -> None:
    scorer = Scorer({})
    scorer.add(0.0, np.zeros(3), -1.0, "septum")
    scorer.add(0.1, np.zeros(3), -1.0, "septum")
    scorer.add(9.0, np.zeros(3), -1.0, "septum")
    assert scorer.score().contact_s == pytest.approx(0.1)
