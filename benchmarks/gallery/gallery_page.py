"""The gallery's page: sheets, and tables of what stands below their pictures."""

from collections.abc import Iterable, Mapping
from statistics import median

from benchmarks.gallery.contact_sheet import Rows, spent
from benchmarks.gallery.panel import Absent, Family, Panel
from benchmarks.machine import Machine
from benchmarks.reporting.pages import markdown_table
from benchmarks.reporting.section import Table

HEAD = """\
# Gallery

The same views of the synthetic head through every mode, light and peer. Made by
`examples/make_pictures.py gallery`; no figure is typed. Below each picture: CPU time of
one picture, error, SSIM of the encoded pictures. What the error is, and against what,
stands with each sheet. All but paths run on one thread; OpenGL is Mesa's, in software.
Times are of small pictures, the least of two or more, or of one where it takes long:
[measurements.md](measurements.md) has the careful ones.

A peer's picture is checked before its time counts: one that is not right has a frame,
no time, and a line that says what is wrong. A peer that is not installed is named.

The head is as in [views.md](views.md), two views are of the bundled flight. Those named
wound are of the head at the end of the bundled operation: tissue taken, bone laid open,
blood; first from where its scope stands. Mode classic and Mitsuba have a pinhole in
the same places, with the same half field.
"""

FOOT = """\
## Make it

    .venv/bin/uv pip install '.[bench]'
    .venv/bin/uv pip install --target out/yt yt==4.4.3
    PARAVOL_YT=out/yt .venv/bin/python examples/make_pictures.py gallery

Mitsuba needs LLVM, see [light.md](light.md). Without the first two lines it and yt are
absent. yt has a folder of its own: a library that it needs brings a package `tests`,
which would hide ours. `--views`, `--size` and `--out` make smaller galleries elsewhere.
"""


def gallery_page(sheets: Mapping[Family, Rows], where: Machine, size: int) -> str:
    """Lay out all families; the pictures lie beside it in ``pictures``."""
    parts = [
        HEAD,
        f"{where.cpu}, {where.cores} cores, load {where.load:g}; "
        f"{size} x {size} pixels.\n",
    ]
    for family, rows in sheets.items():
        parts += _family(family, rows)
    return "\n".join([*parts, FOOT])


def picture_name(family: Family) -> str:
    """Name a family's sheet."""
    return f"gallery_{family.name}.png"


def _family(family: Family, rows: Rows) -> Iterable[str]:
    yield f"## {family.title}\n"
    yield f"{family.told}\n"
    yield f"![{family.title}](pictures/{picture_name(family)})\n"
    yield f"Error: {family.unit}. Reference: {family.reference}.\n"
    yield markdown_table(_summary(family, rows))
    head = ("CPU time; error; SSIM", *family.columns)
    lines = [(name, *map(_cell, panels)) for name, panels in rows.items()]
    yield markdown_table(Table("", head, lines))
    for words in _wrong(rows):
        yield f"- {words}"
    yield ""


def _summary(family: Family, rows: Rows) -> Table:
    """Give each column's medians over the views with a right picture."""
    lines = []
    for number, who in enumerate(family.columns):
        drawn = [
            p for panels in rows.values() if isinstance(p := panels[number], Panel)
        ]
        right = [p for p in drawn if p.cpu_s is not None]
        figures = ("-",) * 4
        if right:
            figures = (
                spent(median(p.cpu_s for p in right if p.cpu_s is not None)),
                f"{median(p.error for p in right):.3g}",
                f"{max(p.error for p in right):.3g}",
                f"{min(p.alike for p in right):.3f}",
            )
        lines.append((who, f"{len(right)} of {len(rows)}", *figures))
    head = ("", "right", "median time", "median error", "worst error", "least SSIM")
    return Table("", head, lines)


def _cell(panel: Panel | Absent) -> str:
    if isinstance(panel, Absent):
        return "absent"
    return f"{spent(panel.cpu_s)}; {panel.error:.3g}; {panel.alike:.3f}"


def _wrong(rows: Rows) -> list[str]:
    """Say what is not right, and once what is absent for one reason."""
    found = []
    absent: dict[Absent, list[str]] = {}
    for name, panels in rows.items():
        for panel in panels:
            if isinstance(panel, Absent):
                absent.setdefault(panel, []).append(name)
            elif panel.why:
                found.append(f"{panel.who}, {name}: {panel.why}")
    for panel, names in absent.items():
        where = "every view" if len(names) == len(rows) else ", ".join(names)
        found.append(f"{panel.who} is absent in {where}: {panel.why}")
    return found
