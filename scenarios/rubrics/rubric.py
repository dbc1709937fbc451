"""A rubric: which metrics, tasks and figures give how many points, as a TOML file.

docs/scoring.md describes the file. What is wrong in one is told with the file, the line
and the nearest valid word.
"""

import difflib
import hashlib
import math
from collections.abc import Collection, Iterator, Sequence
from enum import StrEnum
from itertools import pairwise
from pathlib import Path

import msgspec

from scenarios.metrics import DEFINITIONS, Settings
from scenarios.metrics.removal import REMOVAL
from scenarios.rubrics.assessment import Knots
from scenarios.scenario import Scenario
from scenarios.tasks.task import Remove
from system import UserError
from system.line_finder import toml_line
from system.typed_record import decode_toml

SHIPPED = Path(__file__).parent
"""Folder of the rubrics that come with the program."""

MOST_REMOVAL_PERCENT = 30.0
"""Of a rubric's points, and of those that count in a session, at most so many are for
what was taken: volume removed says little about skill."""

ANY_TASK = "*"

FIGURES = {
    "bled_ml": "ml",
    "broken": "count",
    "greatest_n": "N",
    "lens_touched_s": "s",
    "scope_n": "N",
    "sucked_ml": "ml",
    "washes": "count",
}
"""Figures of an operation that a rubric may use, and their units."""

_REMOVAL_METRICS = frozenset(definition.name for definition in REMOVAL)
_VOLUME = "tissue removed"


class Combine(StrEnum):
    """How the values of a metric that has one for each hazard become one."""

    SUM = "sum"
    LARGEST = "largest"
    SMALLEST = "smallest"


class Source(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Name a value: of a metric, a task or an operation's figure, exactly one.

    name: once in a table; title: what is read. role: whose metric, where several have
    one of this name. of: the hazard, tissue, target or structure; without it all are
    combined. task: its name, or "*" for the share of all tasks that was done.
    """

    name: str
    title: str
    metric: str = ""
    role: str = ""
    of: str = ""
    combine: Combine = Combine.SUM
    task: str = ""
    figure: str = ""

    @property
    def full_name(self) -> str:
        """Return what it reads, in words."""
        if self.task:
            return "all tasks" if self.task == ANY_TASK else f"task: {self.task}"
        if self.figure:
            return f"figure: {self.figure}"
        return f"{self.metric}: {self.of}" if self.of else self.metric

    @property
    def is_removal(self) -> bool:
        """Return whether it is about what was taken."""
        return self.metric in _REMOVAL_METRICS


class Item(Source, frozen=True):
    """Give points for a value.

    points: at most. bands: values that ascend, each with the
    percent of the points that it gives; straight in between, level beyond. why: where
    the thresholds are from. when_done: points are given only where all that the
    exercise asks for was done: who does nothing is quick.
    """

    points: float
    bands: Knots
    why: str = ""
    when_done: bool = False


class FailRule(Source, frozen=True):
    """Bound the total where a value is above, or below, a limit."""

    most_percent: float
    above: float | None = None
    below: float | None = None


class Rubric(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One version of a rubric.

    version: grows with every change of items or settings. total_points: must be the sum
    of the items' points. pass_percent: from so much on a session is passed.
    least_counted_percent: with fewer points to be had, where data lack, there is no
    total; least_path_mm: nor with a shorter way of scope and tool. settings: of the
    metrics.
    """

    name: str
    version: int
    title: str
    total_points: float
    pass_percent: float
    items: tuple[Item, ...]
    fails: tuple[FailRule, ...] = ()
    least_counted_percent: float = 50.0
    least_path_mm: float = 0.0
    settings: Settings = Settings()
    description: str = ""

    def fitted(self, scenario: Scenario) -> "Rubric":
        """Return it with the tissue wanted that an exercise's own tasks want taken."""
        if not scenario.tasks:
            return self
        wanted = {
            tissue: limits.least_mm3
            for task in scenario.tasks
            if isinstance(task, Remove)
            for tissue, limits in task.tissues.items()
            if limits.least_mm3 > 0.0
        }
        settings = msgspec.structs.replace(self.settings, wanted_mm3=wanted)
        return msgspec.structs.replace(self, settings=settings)

    def sha256(self) -> str:
        """Return a hash of all that it says."""
        return hashlib.sha256(msgspec.json.encode(self, order="sorted")).hexdigest()


def shipped_rubrics() -> list[str]:
    """Return the names of the rubrics that come with the program."""
    return sorted(file.stem for file in SHIPPED.glob("*.toml"))


def load_rubric(name: str | Path) -> Rubric:
    """Read a rubric by a shipped name or by the path of its TOML file.

    UserError names file, line and the nearest valid word where something is wrong.
    """
    file = Path(name)
    if file.suffix != ".toml":
        known = shipped_rubrics()
        if str(name) not in known:
            raise UserError(
                f"There is no rubric named {str(name)!r}{_nearest(str(name), known)}; "
                f"known are: {', '.join(known)}. A rubric of your own is given by its "
                "path, ending in .toml."
            )
        file = SHIPPED / f"{name}.toml"
    try:
        content = file.read_bytes()
    except OSError as error:
        raise UserError(
            f"The rubric {file} cannot be read: {error.strerror}."
        ) from error
    rubric = decode_toml(content, Rubric, file, "a rubric")
    for place, wrong in _faults(rubric):
        line = toml_line(content.decode(), place)
        raise UserError(f"{file}, line {line}, is not valid as a rubric: {wrong}.")
    return rubric


Fault = tuple[list[str | int], str]


def _faults(rubric: Rubric) -> Iterator[Fault]:
    """Find what a rubric says that cannot be: its place and a sentence."""
    if rubric.version < 1:
        yield ["version"], f"version must be at least 1, got {rubric.version}"
    if not rubric.items:
        yield ["items"], "it has no items"
    if not 0.0 <= rubric.least_path_mm < math.inf:
        wrong = f"least_path_mm must be at least 0, got {rubric.least_path_mm:g}"
        yield ["least_path_mm"], wrong
    for name in ("pass_percent", "least_counted_percent"):
        value = getattr(rubric, name)
        if not 0.0 <= value <= 100.0:
            yield [name], f"{name} must lie between 0 and 100, got {value:g}"
    tables: tuple[tuple[str, Sequence[Source]], ...]
    tables = ("items", rubric.items), ("fails", rubric.fails)
    for table, rows in tables:
        names: set[str] = set()
        for n, row in enumerate(rows):
            if row.name in names:
                yield [table, n, "name"], f"there are two {table} named {row.name!r}"
            names.add(row.name)
            for key, wrong in _source_faults(row):
                yield [table, n, key], wrong
    for n, item in enumerate(rubric.items):
        for key, wrong in _item_faults(item):
            yield ["items", n, key], wrong
    for n, rule in enumerate(rubric.fails):
        if (rule.above is None) == (rule.below is None):
            yield ["fails", n], f"{rule.name!r} needs either above or below"
        if not 0.0 <= rule.most_percent <= 100.0:
            wrong = f"most_percent must lie between 0 and 100, got {rule.most_percent}"
            yield ["fails", n, "most_percent"], wrong
    total = sum(item.points for item in rubric.items)
    if not math.isclose(total, rubric.total_points, rel_tol=1e-9):
        wrong = f"the items have {total:g} points, but total_points says "
        yield ["total_points"], f"{wrong}{rubric.total_points:g}"
    removal = sum(item.points for item in rubric.items if item.is_removal)
    if removal > total * MOST_REMOVAL_PERCENT / 100.0:
        yield (
            ["items"],
            f"{removal:g} of {total:g} points are for tissue that is removed; at most "
            f"{MOST_REMOVAL_PERCENT:g} % may be, so that volume does not dominate",
        )


def _source_faults(source: Source) -> Iterator[tuple[str, str]]:
    given = [name for name in ("metric", "task", "figure") if getattr(source, name)]
    if len(given) != 1:
        got = " and ".join(given) or "none"
        yield "name", f"it needs one of metric, task and figure, got {got}"
        return
    if source.figure and source.figure not in FIGURES:
        near = _nearest(source.figure, FIGURES)
        yield "figure", f"there is no figure {source.figure!r}{near}"
    if not source.metric:
        for name in ("role", "of"):
            if getattr(source, name):
                yield name, f"{name} goes with a metric"
        return
    known = {definition.name for definition in DEFINITIONS}
    if source.metric not in known:
        near = _nearest(source.metric, known)
        yield "metric", f"there is no metric {source.metric!r}{near}"
        return
    roles = [d.role for d in DEFINITIONS if d.name == source.metric]
    if source.role not in roles and (source.role or len(roles) > 1):
        got = f", got {source.role!r}" if source.role else ""
        yield "role", f"the role of {source.metric!r} must be {_either(roles)}{got}"


def _item_faults(item: Item) -> Iterator[tuple[str, str]]:
    if not 0.0 < item.points < math.inf:
        yield "points", f"points must be above 0, got {item.points:g}"
    values = [value for value, _ in item.bands]
    percents = [percent for _, percent in item.bands]
    if len(values) < 2:
        yield "bands", "bands need at least two values"
        return
    if not all(map(math.isfinite, values)):
        yield "bands", "the values of bands must be finite"
    if any(b <= a for a, b in pairwise(values)):
        yield "bands", f"the values of bands must ascend, got {values}"
    if not all(0.0 <= percent <= 100.0 for percent in percents):
        yield "bands", f"the percents of bands must lie in 0 to 100, got {percents}"
    if max(percents) < 100.0:
        yield "bands", f"no value gives 100 %, got at most {max(percents):g}"
    if item.metric == _VOLUME and percents[-1] == 100.0:
        wrong = "taking ever more tissue must not keep its points: let bands end below"
        yield "bands", f"{wrong} 100 %"


def _either(words: Collection[str]) -> str:
    return " or ".join(repr(word) for word in words)


def _nearest(word: str, known: Collection[str]) -> str:
    found = difflib.get_close_matches(word, sorted(known), 1)
    return f"; did you mean {found[0]!r}?" if found else ""
