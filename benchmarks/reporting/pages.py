"""The results as pages: HTML that needs nothing else, and the documents' Markdown."""

from collections.abc import Iterable
from pathlib import Path

from markupsafe import Markup

from benchmarks.reporting.section import Section, Table
from benchmarks.reporting.survey import survey
from benchmarks.schema import Results
from paravol.debrief.colours import TEMPLATES as DEBRIEF
from paravol.debrief.colours import templates
from system import whole_file

TEMPLATES = Path(__file__).parent / "templates"

HEAD = """\
# Measurements

Made by `paravol bench report` from what `paravol bench` measured. *time*: the least of
the repeats, wall clock. *ratio*: the baseline's time over the row's own, both taken in
this run; above 1 is faster than the baseline. *RMSE* and *99.9 %*: the error against
the row's reference, in the unit named; lines with an arrow tell further errors by
name. `~` marks a row that something else disturbed. The charts are in the HTML page;
pictures by every mode, light and peer are in [gallery.md](gallery.md).
"""


def html_page(results: Results) -> str:
    """Return the whole HTML file; the same results give the same text."""
    # the debrief's style sheet, and what only this page has
    environment = templates(TEMPLATES, DEBRIEF)
    sheets = [
        environment.get_template(name).render() for name in ("page.css", "report.css")
    ]
    # ours, with nothing from any file in them
    style = Markup("\n".join(sheets))
    page = environment.get_template("report.html")
    return page.render(style=style, sections=survey(results))


def write_report(results: Results, path: Path) -> Path:
    """Write the page as a whole and return its path."""
    text = html_page(results)
    with whole_file(path) as beside:
        beside.write_text(text, encoding="utf-8")
    return path


def measurements_page(results: Results) -> str:
    """Lay out all sections, a heading for each and a table for each case."""
    parts = [HEAD]
    for section in survey(results):
        parts += _section(section)
    return "\n".join(parts)


def _section(section: Section) -> Iterable[str]:
    if not section.words and not section.tables:
        return
    yield f"## {section.title}\n"
    yield from (f"{_escaped(words)}\n" for words in section.words)
    for table in section.tables:
        yield f"**{_escaped(table.caption)}**\n"
        yield markdown_table(table)


def markdown_table(table: Table) -> str:
    """Lay out a table, figures to the right."""
    bars = ["---" if n in table.texts else "---:" for n in range(len(table.head))]
    lines = [table.head, bars, *table.rows]
    return "".join(f"| {' | '.join(map(_escaped, line))} |\n" for line in lines)


def _escaped(text: str) -> str:
    for mark in "|<*":
        text = text.replace(mark, f"\\{mark}")
    return text
