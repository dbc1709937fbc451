from dataclasses import replace

import pytest

from benchmarks.simulated_ranks.simulated_machine import T3D
from benchmarks.simulated_ranks.study import (
    PAPER_S,
    Setup,
    Traces,
    paper_sample_s,
    simulate,
    simulated_slots,
)
from benchmarks.simulated_ranks.trace import Orbit
from renderers.art.ranks.policy import Dataflow

SMALL = Orbit(side=32, image=64, packet=4)


@pytest.fixture(scope="module")
def traces() -> Traces:
    """Trace a small orbit."""
    return Traces(SMALL)


@pytest.fixture(scope="module")
def setup(traces: Traces) -> Setup:
    """Set up 4 ranks on the paper's machine."""
    sample_s = 30.0 / traces.samples(3)
    return Setup(4, SMALL, 3, T3D, sample_s, tile=8)


def test_one_rank_needs_what_its_samples_cost(setup: Setup, traces: Traces) -> None:
    outcome = simulate(replace(setup, ranks=1), traces)
    assert outcome.seconds == pytest.approx(30.0, rel=1e-3)
    assert outcome.overhead == 0.0
    assert outcome.sent == {}


OF_CELLS = (Dataflow.REPLICATED, Dataflow.STATIC, Dataflow.MIGRATING)


@pytest.mark.parametrize("dataflow", OF_CELLS)
@pytest.mark.parametrize("cache", [1.5, 4.0])
def test_every_way_does_the_same_work(
    setup: Setup, traces: Traces, dataflow: Dataflow, cache: float
) -> None:
    outcome = simulate(replace(setup, dataflow=dataflow, cache=cache), traces)
    shares = outcome.shares()
    work = (shares["render"] + shares["lru"]) * outcome.seconds * 4
    assert work == pytest.approx(30.0)
    assert sum(shares.values()) == pytest.approx(1.0, rel=5e-3)
    assert outcome.seconds >= 30.0 / 4
    assert len(outcome.frame_s) == 3
    assert sum(outcome.frame_s) == pytest.approx(outcome.seconds)
    if dataflow is Dataflow.REPLICATED:
        assert outcome.sent == {}
    elif dataflow is Dataflow.STATIC:
        assert set(outcome.sent) == {"REQUEST", "DATA"}
        assert outcome.sent["REQUEST"] == outcome.sent["DATA"]
    else:
        assert outcome.sent["DATA"] == outcome.cells_fetched


def test_the_same_setup_gives_the_same_outcome(setup: Setup, traces: Traces) -> None:
    tight = replace(setup, cache=1.5, frames=1)
    first, second = (
        simulate(replace(tight, validate=v), traces) for v in (False, True)
    )
    assert replace(second, setup=first.setup) == first
    assert first.owners_moved > 0


def test_smaller_caches_fetch_more(setup: Setup, traces: Traces) -> None:
    fetched = [
        simulate(replace(setup, cache=cache), traces).cells_fetched
        for cache in (4.0, 2.0, 1.25)
    ]
    assert fetched == sorted(fetched)
    assert fetched[0] < fetched[-1]


def test_the_papers_speed_up_comes_out() -> None:
    traces = Traces(Orbit())
    sample_s = paper_sample_s(traces, 2, 128)
    for ranks, tile in ((8, 32), (16, 16)):
        outcome = simulate(
            Setup(ranks, traces.orbit, 2, T3D, sample_s, tile=tile), traces
        )
        paper = PAPER_S[128][1] / (PAPER_S[128][ranks] * ranks)
        found = PAPER_S[128][1] * 2 / 30 / (outcome.seconds * ranks)
        assert found == pytest.approx(paper, abs=0.03)
        assert outcome.overhead <= 0.003


def test_memory_is_the_same_for_every_way(setup: Setup) -> None:
    slots = {
        way: simulated_slots(replace(setup, dataflow=way, cache=2.0))[0]
        for way in OF_CELLS
    }
    share = SMALL.cells // 4
    assert slots[Dataflow.MIGRATING] == slots[Dataflow.STATIC] + share == 2 * share


def test_the_share_of_noting_use_is_counted(setup: Setup, traces: Traces) -> None:
    outcome = simulate(replace(setup, cache=4.0), traces)
    touches = sum(traces.frame(k).crossings for k in range(3))
    spent = sum(ledger.lru for ledger in outcome.ledgers)
    assert spent == pytest.approx(touches * T3D.touch_s)
    whole = simulate(replace(setup, dataflow=Dataflow.REPLICATED), traces)
    assert whole.shares()["lru"] == 0.0
