import numpy as np
import pytest

from benchmarks.ranks.calibration import PATTERNS, fit_messages, real_time
from benchmarks.ranks.message_costs import PatternCost, PatternReport

POLL_S, REST_S = 2e-6, 1e-6


def reports(costs: tuple[float, float, float], seed: int) -> list[PatternReport]:
    """Make what two ranks would report where messages, bundles and bytes cost that."""
    random = np.random.default_rng(seed)
    found = []
    for _ in range(2):
        parts = []
        for pattern in PATTERNS:
            messages = 2 * pattern.visits
            bundles = messages // pattern.at_once
            size = pattern.visits * pattern.cell_bytes
            looks, rests = (int(n) for n in random.integers(100, 5000, 2))
            exact = np.array(costs) @ (messages, bundles, size)
            parts.append(
                PatternCost(
                    spent_s=float(exact) + looks * POLL_S + rests * REST_S,
                    messages=messages,
                    bundles=bundles,
                    bytes=size,
                    looks=looks,
                    rests=rests,
                    latency_s=(),
                )
            )
        found.append(PatternReport(patterns=tuple(parts)))
    return found


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("costs", [(9e-6, 1e-5, 2e-9), (5e-6, 0.0, 1e-9)])
def test_what_messages_cost_is_found_from_patterns(
    costs: tuple[float, float, float], seed: int
) -> None:
    found = fit_messages(reports(costs, seed), POLL_S, REST_S)
    assert found == pytest.approx(costs, rel=1e-6, abs=1e-12)


def test_the_quickest_of_each_pattern_counts() -> None:
    costs = (9e-6, 1e-5, 2e-9)
    quick, slow = reports(costs, 1), reports((3e-5, 3e-5, 6e-9), 2)
    both = [
        PatternReport(patterns=b.patterns + a.patterns)
        for a, b in zip(quick, slow, strict=True)
    ]
    found = fit_messages(both, POLL_S, REST_S)
    assert found == pytest.approx(costs, rel=1e-6)


def test_real_time_is_asked_for_only_where_it_may_be() -> None:
    assert real_time() in ((), ("chrt", "-r", "1"))
