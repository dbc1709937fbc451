"""What a benchmark leaves on disk: one row for each measurement.

The file is replaced as a whole after every row, so that an interrupted run can go on
from what it has.
"""

import math
from pathlib import Path
from typing import Literal

import msgspec

from benchmarks.machine import Machine
from disk import UserError, whole_file

SCHEMA_VERSION = 1

Clock = Literal["cpu", "wall"]
Setting = str | int | float | bool

NOISY_SPREAD = 0.2
"""A median farther above the minimum than this tells of a disturbed measurement."""


class Times(msgspec.Struct, frozen=True, kw_only=True):
    """Hold wall-clock seconds of the repeats."""

    min: float
    median: float


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """Hold one measurement.

    case: ``scene/view/quantity``, or what a start-up row starts. mode: who did it
        and how. baseline: the mode of the same case that `ratio` compares with.
    time_s: wall clock. cpu_s: smallest CPU time of one repeat, all threads together.
    clock: which of the two `ratio` is made of: CPU time where both ran on one
        thread, since other programs disturb it least.
    baseline_s: the baseline's seconds by that clock, measured in the same run as
        this row. ratio: ``baseline_s`` over this row's own seconds; above one is
        faster than the baseline.
    rmse, p999, max, bias: error against settings["reference"] in `error_unit`; None
        for what has no picture.
    counters: what the work took and any further figures of its result.
    settings: everything the measurement depends on; part of the row's identity.
    """

    suite: str
    case: str
    mode: str
    baseline: str | None
    time_s: Times
    cpu_s: float
    repeats: int
    clock: Clock
    baseline_s: float | None
    ratio: float | None
    error_unit: str | None
    rmse: float | None
    p999: float | None
    max: float | None
    bias: float | None
    counters: dict[str, float]
    settings: dict[str, Setting]
    machine: Machine
    versions: dict[str, str]
    commit: str

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Return what tells one measurement from another."""
        return row_key(self.suite, self.case, self.mode, self.settings)

    @property
    def seconds(self) -> float:
        """Return the smallest time by the row's own clock."""
        return seconds_by(self.clock, self)

    @property
    def is_noisy(self) -> bool:
        """Return whether something else kept the machine busy meanwhile."""
        return self.time_s.median > (1 + NOISY_SPREAD) * self.time_s.min


class Skipped(msgspec.Struct, frozen=True, kw_only=True):
    """Say what could not be measured, and why."""

    suite: str
    case: str
    mode: str
    reason: str


class Results(msgspec.Struct, kw_only=True):
    """Hold ``results.json``."""

    schema_version: int = SCHEMA_VERSION
    rows: list[Row] = msgspec.field(default_factory=list)
    skipped: list[Skipped] = msgspec.field(default_factory=list)

    def put(self, row: Row) -> None:
        """Add a row in place of an older one of the same measurement."""
        keys = [old.key for old in self.rows]
        if row.key in keys:
            self.rows[keys.index(row.key)] = row
        else:
            self.rows.append(row)


def row_key(
    suite: str, case: str, mode: str, settings: dict[str, Setting]
) -> tuple[str, str, str, str]:
    """Return the identity of a measurement, whatever machine and commit ran it."""
    return suite, case, mode, msgspec.json.encode(settings, order="sorted").decode()


def seconds_by(clock: Clock, row: Row) -> float:
    """Return the smallest time of a row by either clock."""
    return row.cpu_s if clock == "cpu" else row.time_s.min


def ratio_of(baseline_s: float, own_s: float) -> float:
    """Return how many times faster than the baseline; ValueError for no time at all."""
    for name, value in (("baseline", baseline_s), ("own", own_s)):
        if not (math.isfinite(value) and value > 0):
            raise UserError(f"the {name} time must be positive seconds, got {value}")
    return baseline_s / own_s


def load_results(path: Path) -> Results:
    """Read ``results.json``; an absent file gives empty results.

    Raises ValueError when it is not one, or of another schema.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return Results()
    try:
        found = msgspec.json.decode(content, type=Results)
    except msgspec.DecodeError as error:
        raise UserError(
            f"{path} is not a results file ({error}); move it away or use --fresh"
        ) from error
    if found.schema_version != SCHEMA_VERSION:
        raise UserError(
            f"{path} has schema {found.schema_version}, this program writes "
            f"{SCHEMA_VERSION}; move it away or use --fresh"
        )
    return found


def save_results(results: Results, path: Path) -> None:
    """Replace ``results.json`` as a whole."""
    content = msgspec.json.format(msgspec.json.encode(results), indent=1)
    with whole_file(path) as beside:
        beside.write_bytes(content + b"\n")
