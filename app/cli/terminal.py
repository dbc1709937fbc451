"""What a person at the terminal sees: progress, one table, one sentence per error."""

import json
import sys
from typing import TYPE_CHECKING, Self

import msgspec

from system.plain_text import plain, raw_stream

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


class ProgressReporter:
    """Show long work as named stages with bars; a context manager.

    On a terminal each stage is a bar; in a log file a line when it begins. Everything
    goes to standard error, so that ``--json`` leaves standard output to the result.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        """quiet: show nothing."""
        self._quiet = quiet
        self._bars: Progress | None = None
        self._tasks: dict[str, TaskID] = {}
        self._named: set[str] = set()

    def __enter__(self) -> Self:
        if not self._quiet and sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import (
                BarColumn,
                Progress,
                TaskProgressColumn,
                TextColumn,
                TimeElapsedColumn,
            )

            self._bars = Progress(
                TextColumn("{task.description:<34}", markup=False),
                BarColumn(),
                TaskProgressColumn(),
                TimeElapsedColumn(),
                console=Console(file=raw_stream(sys.stderr)),
            )
            self._bars.start()
        return self

    def __exit__(self, *error: object) -> None:
        if self._bars is not None:
            self._bars.stop()
            self._bars = None

    def __call__(self, stage: str, share: float) -> None:
        """Set a stage's done share, 0 to 1; an unknown stage begins."""
        if self._quiet:
            return
        if self._bars is None:
            if stage not in self._named:
                self._named.add(stage)
                print(f"{stage} ...", file=sys.stderr, flush=True)
            return
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(plain(stage), total=1.0)
        self._bars.update(self._tasks[stage], completed=min(max(share, 0.0), 1.0))

    def say(self, text: str) -> None:
        """Print one line between the bars."""
        if self._quiet:
            return
        if self._bars is None:
            print(text, file=sys.stderr, flush=True)
        else:
            self._bars.console.print(plain(text), highlight=False, markup=False)


def print_json(value: object) -> None:
    """Print a result for machines on standard output."""
    print(json.dumps(msgspec.to_builtins(value), indent=2, allow_nan=False))


def print_table(
    title: str, rows: list[tuple[str, str]], greyed: frozenset[int] = frozenset()
) -> None:
    """Print named figures as one table on standard output.

    greyed: places of the rows that do not count; a terminal shows them dimmed.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    heading = Text(plain(title))
    table = Table(title=heading, show_header=False, title_justify="left")
    for place, (name, value) in enumerate(rows):
        # what stands in brackets is no markup: pip install 'paravol-ess[mpi]'
        style = "dim" if place in greyed else None
        table.add_row(Text(plain(name)), Text(plain(value)), style=style)
    Console(file=raw_stream(sys.stdout)).print(table, highlight=False)
