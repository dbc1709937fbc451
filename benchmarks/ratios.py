"""What a release is compared with later: ratios of one run, and errors.

Times of two days cannot be compared; ratios of two measurements of one run can.
"""

import statistics
from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec

from benchmarks.losslessness import DIFFER
from benchmarks.machine import ROOT, Machine
from benchmarks.schema import Measurement, Results, Setting, row_key
from system import UserError, whole_file

Key = tuple[str, str, str, str]
"""What tells one measurement from another; see `row_key`."""

RELEASED = ROOT / "benchmarks" / "results" / "ratios.json"
RMSE = "RMSE"


class Ratio(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """What is compared of one row. ratio: above one is faster than the baseline.

    errors: by name; smaller is better. scatter: highest ratio over the least, of the
    rounds in which a release was measured.
    """

    suite: str
    case: str
    mode: str
    settings: dict[str, Setting]
    baseline: str | None = None
    ratio: float | None = None
    errors: dict[str, float] = msgspec.field(default_factory=dict)
    scatter: float = 1.0

    @property
    def key(self) -> Key:
        """Return what tells one measurement from another."""
        return row_key(self.suite, self.case, self.mode, self.settings)

    def better_of(self, other: "Ratio") -> "Ratio":
        """Return the higher ratio and the smaller errors of two measurements."""
        ratios = [r.ratio for r in (self, other) if r.ratio is not None]
        errors = dict(self.errors)
        for name, value in other.errors.items():
            errors[name] = min(value, errors.get(name, value))
        return msgspec.structs.replace(
            self, ratio=max(ratios, default=None), errors=errors
        )


class Ratios(msgspec.Struct, kw_only=True):
    """The file: what was compared, where, and of which sources."""

    machine: Machine
    commit: str
    rows: list[Ratio]


def ratios_of(rows: Iterable[Measurement]) -> list[Ratio]:
    """Take from rows what can be compared; rows with neither are left out."""
    found = []
    for row in rows:
        errors = {DIFFER: row.counters[DIFFER]} if DIFFER in row.counters else {}
        if row.rmse is not None:
            errors[RMSE] = row.rmse
        if row.ratio is not None or errors:
            found.append(
                Ratio(
                    suite=row.suite,
                    case=row.case,
                    mode=row.mode,
                    settings=row.settings,
                    baseline=row.baseline,
                    ratio=row.ratio,
                    errors=errors,
                )
            )
    return found


def best_of(runs: Iterable[Results]) -> list[Ratio]:
    """Merge runs: of every row the higher ratio and the smaller errors."""
    found: dict[Key, Ratio] = {}
    for run in runs:
        for ratio in ratios_of(run.rows):
            first = found.get(ratio.key)
            found[ratio.key] = ratio if first is None else first.better_of(ratio)
    return list(found.values())


def middle_of(runs: Sequence[Results]) -> list[Ratio]:
    """Merge runs: of every row the middle ratio, its scatter, the smaller errors."""
    rounds: dict[Key, list[float]] = {}
    for run in runs:
        for row in ratios_of(run.rows):
            if row.ratio is not None:
                rounds.setdefault(row.key, []).append(row.ratio)
    kept = []
    for best in best_of(runs):
        if found := rounds.get(best.key):
            middle, scatter = statistics.median(found), max(found) / min(found)
            best = msgspec.structs.replace(best, ratio=middle, scatter=scatter)
        kept.append(best)
    return kept


def load_ratios(path: Path) -> Ratios:
    """Read a release's file. Raises UserError where it is absent or is not one."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=Ratios)
    except FileNotFoundError as error:
        raise UserError(
            f"{path} is not there; paravol bench guard --store makes it"
        ) from error
    except msgspec.DecodeError as error:
        raise UserError(f"{path} does not hold ratios ({error})") from error


def save_ratios(ratios: Ratios, path: Path) -> None:
    """Replace a release's file as a whole, a row a line."""
    rows = ",\n".join(msgspec.json.encode(row).decode() for row in ratios.rows)
    machine = msgspec.json.encode(ratios.machine).decode()
    commit = msgspec.json.encode(ratios.commit).decode()
    with whole_file(path) as beside:
        beside.write_text(
            f'{{"machine": {machine},\n"commit": {commit},\n"rows": [\n{rows}\n]}}\n',
            encoding="utf-8",
        )
