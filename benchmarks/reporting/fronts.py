"""Run time against error: which rows can be compared, and which of them nothing beats.

The times are of each row's own clock. On the front is what no other row on one thread
equals or beats in both time and error.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from benchmarks.schema import Row


@dataclass(slots=True)
class Comparison:
    """Rows of one picture: the same view, size, lens, reference.

    series: coarse steps first. own_reference: names of those series that are compared
    with their own finest picture.
    """

    case: str
    size: str
    unit: str
    reference: str
    series: dict[str, list[Row]] = field(default_factory=dict)
    own_reference: set[str] = field(default_factory=set)

    @property
    def title(self) -> str:
        """Return what the picture is of."""
        size = f", {self.size} px" if self.size else ""
        return ", ".join(self.case.split("/")) + size

    @property
    def rows(self) -> list[Row]:
        """Return all rows, each measurement once."""
        return [row for rows in self.series.values() for row in rows]

    @property
    def front(self) -> list[Row]:
        """Return the rows that nothing beats, the fastest first."""
        return pareto_front([row for row in self.rows if row.clock == "cpu"])


def comparisons(rows: Iterable[Row]) -> list[Comparison]:
    """Sort rows that have an error into panels that have something to compare."""
    found: dict[tuple[str, ...], Comparison] = {}
    apart: list[Row] = []
    for row in rows:
        told = row.settings
        if not row.rmse or "series" not in told or "reference" not in told:
            continue
        if told.get("self_referenced"):
            apart.append(row)
            continue
        key = (*_picture(row), str(told["reference"]))
        panel = found.setdefault(
            key, Comparison(row.case, f"{told.get('size', '')}", key[-2], key[-1])
        )
        _put(panel, row)
    for row in apart:
        for key, panel in found.items():
            if key[:-1] == _picture(row):
                _put(panel, row)
                panel.own_reference.add(f"{row.settings['series']}")
    for panel in found.values():
        for points in panel.series.values():
            points.sort(key=lambda row: -float(row.settings.get("step_voxels", 0)))
    chosen = [panel for panel in found.values() if len(panel.rows) > 1]
    return sorted(chosen, key=lambda panel: (panel.case, panel.size, panel.reference))


def pareto_front(rows: Sequence[Row]) -> list[Row]:
    """Return rows that no other equals or beats in both time and error.

    Of rows alike in both the first stays. The fastest comes first.
    """
    found: list[Row] = []
    for row in sorted(rows, key=lambda row: (row.seconds, row.rmse or 0.0)):
        assert row.rmse is not None
        if not found or row.rmse < (found[-1].rmse or 0.0):
            found.append(row)
    return found


def _picture(row: Row) -> tuple[str, ...]:
    told = row.settings
    words = (told.get("size", ""), told.get("lens", ""), row.error_unit or "")
    return (row.case, *map(str, words))


def _put(panel: Comparison, row: Row) -> None:
    points = panel.series.setdefault(f"{row.settings['series']}", [])
    # The same measurement may stand in two suites, as one's baseline.
    if row.mode not in [other.mode for other in points]:
        points.append(row)
