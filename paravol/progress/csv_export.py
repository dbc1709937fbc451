"""Sessions as one table for a spreadsheet or for statistics."""

from collections.abc import Sequence
from io import StringIO

from paravol.progress.session_entry import PERCENT, SessionEntry
from system.csv_table import CsvTable

COLUMNS = (
    *("trainee", "exercise", "begun", "session", "sha256", "duration_s", "complete"),
    *("passed", "rubric", "rubric_version", "role", "figure", "unit", "value", "sigma"),
)


def as_csv(entries: Sequence[SessionEntry]) -> str:
    """Return a row for each figure of each session; the percent is one of them.

    A value or an answer that there is not is an empty cell. A session without any
    figure has one row.
    """
    text = StringIO()
    table = CsvTable(text)
    table.add(COLUMNS)
    for entry in entries:
        scored = entry.scored
        head = [
            entry.trainee,
            entry.exercise,
            entry.begun,
            entry.bundle,
            entry.sha256,
            repr(entry.duration_s),
            _word(entry.is_complete),
            _word(entry.has_passed),
            "" if scored is None else scored.rubric,
            "" if scored is None else scored.version,
        ]
        percent = entry.value(PERCENT)
        figures = [*([] if percent is None else [percent]), *entry.values]
        for value in figures:
            cells = ("" if v is None else repr(v) for v in (value.value, value.sigma))
            table.add([*head, value.role, value.name, value.unit, *cells])
        if not figures:
            table.add([*head, *[""] * 5])
    return text.getvalue()


def _word(answer: bool | None) -> str:
    return "" if answer is None else str(answer).lower()
