"""A part of the report: words, tables and charts, whatever it is written as."""

from collections.abc import Sequence
from dataclasses import dataclass, field

Cells = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Table:
    """A table of words. texts: the columns that are no figures, by number.

    bad: the numbers of rows that tell of something wrong.
    """

    caption: str
    head: Cells
    rows: Sequence[Cells]
    texts: frozenset[int] = frozenset({0})
    bad: frozenset[int] = frozenset()


@dataclass(frozen=True, slots=True)
class Chart:
    """A picture in a page. title: what stands below it. address: ``data:``."""

    title: str
    address: str


@dataclass(slots=True)
class Section:
    """A part under a heading. is_long: shown only when it is asked for."""

    anchor: str
    title: str
    words: list[str] = field(default_factory=list)
    charts: list[Chart] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    is_long: bool = False


def duration(seconds: float) -> str:
    """Return three digits in the unit that suits them."""
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("us", 1e6)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.3g} ns"
