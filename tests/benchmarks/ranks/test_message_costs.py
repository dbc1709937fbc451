from pathlib import Path

from benchmarks.ranks.message_costs import Pattern, PatternJob, run_patterns
from tests.mpi.launching import NEEDS_RANKS

pytestmark = NEEDS_RANKS


def test_what_is_missed_together_is_sent_as_one(tmp_path: Path) -> None:
    visits = 320
    patterns = tuple(Pattern(visits=visits, at_once=n, cell_bytes=64) for n in (1, 16))
    reports = run_patterns(2, PatternJob(patterns=patterns, waits=True), tmp_path)
    for report in reports:
        single, joint = report.patterns
        for part in report.patterns:
            # A request for each visit here, and a cell for each of the other rank's.
            assert 2 * visits <= part.messages <= 2 * visits + 3
            assert len(part.latency_s) == visits
            assert part.spent_s > 0
        assert single.bundles >= 2 * visits
        assert joint.bundles <= 2 * visits / 16 + 3
        assert min(report.poll_s, report.rest_s, report.sleep_s) > 0
