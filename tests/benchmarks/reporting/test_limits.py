"""Shares of limits are those that the rows tell."""

from benchmarks.reporting.limits import limit_tables
from benchmarks.schema import Results


def test_each_kind_of_limit_has_its_table(results: Results) -> None:
    rays, splats, threads = limit_tables(results.rows)
    assert rays.rows == [("rays", "phantom/inside/wall", "23.2", "5.8", "25%")]
    assert splats.rows == [("splats", "phantom/inside/wall", "123,456", "2.5")]
    assert threads.rows == [
        ("ART, two threads", "phantom/inside/wall", "2", "1.8", "90%")
    ]
    assert limit_tables([]) == []
