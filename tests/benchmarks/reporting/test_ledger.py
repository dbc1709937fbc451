"""Only what was compared, bit for bit, is called lossless."""

import msgspec
import pytest

from benchmarks.losslessness import COMPARED, DIFFER
from benchmarks.reporting.ledger import is_lossless, skipping_table
from benchmarks.schema import Results, Row


@pytest.mark.parametrize(
    ("counters", "proven"),
    [
        ({COMPARED: 10.0, DIFFER: 0.0}, True),
        ({COMPARED: 10.0, DIFFER: 1.0}, False),
        ({COMPARED: 0.0, DIFFER: 0.0}, False),
        ({COMPARED: 10.0}, False),
        ({}, False),
    ],
)
def test_only_equal_bits_are_a_proof(
    row: Row, counters: dict[str, float], proven: bool
) -> None:
    assert is_lossless(msgspec.structs.replace(row, counters=counters)) == proven


def test_the_ledger_tells_what_was_saved_and_what_failed(results: Results) -> None:
    table = skipping_table(results.rows)
    good, bad = (dict(zip(table.head, row, strict=True)) for row in table.rows)
    assert good["skipped"] == "clear space"
    assert (good["time saved"], good["times faster"]) == ("75%", "4")
    assert good["proof"] == "0 of 5,000 values differ"
    assert bad["proof"] == "7 of 5,000 values differ"
    assert table.bad == {1}
