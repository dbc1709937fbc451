"""What a benchmark leaves on disk: one row for each measurement.

The file is replaced as a whole after every row, so that an interrupted run can go on
from what it has. It names machine and sources once for all rows that share them, and
has a row a line, so that it can be kept and compared.
"""

import math
from pathlib import Path
from typing import Literal

import msgspec

from benchmarks.machine import Machine
from system import UserError, whole_file

SCHEMA_VERSION = 2

Clock = Literal["cpu", "wall"]
Setting = str | int | float | bool

NOISY_SPREAD = 0.2
"""A median farther above the minimum than this tells of a disturbed measurement."""


class Times(msgspec.Struct, frozen=True, kw_only=True):
    """Wall-clock seconds of the repeats."""

    min: float
    median: float


class Measurement(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One measurement, wherever it was made.

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
    further_rmse: errors against other references, or of other pictures that the row
        depends on, in `error_unit`; each name says which.
    counters: what the work took and any further figures of its result.
    settings: everything the measurement depends on; part of the row's identity.
    """

    suite: str
    case: str
    mode: str
    baseline: str | None = None
    time_s: Times
    cpu_s: float
    repeats: int
    clock: Clock
    baseline_s: float | None = None
    ratio: float | None = None
    error_unit: str | None = None
    rmse: float | None = None
    p999: float | None = None
    max: float | None = None
    bias: float | None = None
    further_rmse: dict[str, float] = msgspec.field(default_factory=dict)
    counters: dict[str, float]
    settings: dict[str, Setting]

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Return what tells one measurement from another."""
        return row_key(self.suite, self.case, self.mode, self.settings)

    @property
    def seconds(self) -> float:
        """Return the smallest time by the row's own clock."""
        return self.seconds_by(self.clock)

    def seconds_by(self, clock: Clock) -> float:
        """Return the smallest time by either clock."""
        return self.cpu_s if clock == "cpu" else self.time_s.min

    @property
    def is_noisy(self) -> bool:
        """Return whether something else kept the machine busy meanwhile."""
        return self.time_s.median > (1 + NOISY_SPREAD) * self.time_s.min


class Row(Measurement, frozen=True, kw_only=True, omit_defaults=True):
    """A measurement and what made it."""

    machine: Machine
    versions: dict[str, str]
    commit: str


class Skipped(msgspec.Struct, frozen=True, kw_only=True):
    """What could not be measured, and why."""

    suite: str
    case: str
    mode: str
    reason: str


class Results(msgspec.Struct, kw_only=True):
    """Hold ``results.json``."""

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


def ratio_of(baseline_s: float, own_s: float) -> float:
    """Return how many times faster than the baseline; UserError for no time at all."""
    for name, value in (("baseline", baseline_s), ("own", own_s)):
        if not (math.isfinite(value) and value > 0):
            raise UserError(f"the {name} time must be positive seconds, got {value}")
    return baseline_s / own_s


def load_results(path: Path) -> Results:
    """Read ``results.json``; an absent file gives empty results.

    Raises UserError when it is not one, or of another schema.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return Results()
    try:
        version = msgspec.json.decode(content, type=_Version).schema_version
        if version != SCHEMA_VERSION:
            raise UserError(
                f"{path} has schema {version}, this program writes {SCHEMA_VERSION}; "
                "move it away or use --fresh"
            )
        found = msgspec.json.decode(content, type=_File)
        rows = [_row(stored, found.origins) for stored in found.rows]
    except (msgspec.DecodeError, IndexError) as error:
        raise UserError(
            f"{path} is not a results file ({error}); move it away or use --fresh"
        ) from error
    return Results(rows=rows, skipped=found.skipped)


def save_results(results: Results, path: Path) -> None:
    """Replace ``results.json`` as a whole."""
    content = results_text(results)
    with whole_file(path) as beside:
        beside.write_text(content, encoding="utf-8")


def results_text(results: Results) -> str:
    """Return what ``results.json`` says, a row a line."""
    places: dict[bytes, int] = {}
    rows = []
    for row in results.rows:
        calm = msgspec.structs.replace(row.machine, load=0.0)
        origin = _Origin(machine=calm, versions=row.versions, commit=row.commit)
        place = places.setdefault(msgspec.json.encode(origin), len(places))
        told = {name: getattr(row, name) for name in Measurement.__struct_fields__}
        stored = _StoredRow(**told, origin=place, load=row.machine.load)
        rows.append(msgspec.json.encode(stored, enc_hook=_plain).decode())
    skipped = [msgspec.json.encode(skip).decode() for skip in results.skipped]
    parts = (
        f'"schema_version": {SCHEMA_VERSION}',
        _lines("origins", [one.decode() for one in places]),
        _lines("rows", rows),
        _lines("skipped", skipped),
    )
    return "{" + ",\n".join(parts) + "}\n"


def _plain(value: object) -> float:
    """Return numpy's real numbers as Python's: to a type checker they are the same."""
    if isinstance(value, float):
        return float(value)
    raise NotImplementedError(f"no JSON for {type(value).__name__}")


class _Version(msgspec.Struct):
    schema_version: int


class _Origin(msgspec.Struct, kw_only=True):
    """What made rows; the load of the machine is the row's own."""

    machine: Machine
    versions: dict[str, str]
    commit: str


class _StoredRow(Measurement, frozen=True, kw_only=True, omit_defaults=True):
    origin: int
    load: float


class _File(msgspec.Struct, kw_only=True):
    origins: list[_Origin] = msgspec.field(default_factory=list)
    rows: list[_StoredRow] = msgspec.field(default_factory=list)
    skipped: list[Skipped] = msgspec.field(default_factory=list)


def _row(stored: _StoredRow, origins: list[_Origin]) -> Row:
    origin = origins[stored.origin]
    told = {name: getattr(stored, name) for name in Measurement.__struct_fields__}
    return Row(
        **told,
        machine=msgspec.structs.replace(origin.machine, load=stored.load),
        versions=origin.versions,
        commit=origin.commit,
    )


def _lines(name: str, items: list[str]) -> str:
    inside = ",\n".join(items)
    return f'"{name}": [\n{inside}\n]' if items else f'"{name}": []'
