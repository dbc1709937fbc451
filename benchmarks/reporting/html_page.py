"""The results as one page that needs nothing else."""

from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from benchmarks.reporting.survey import survey
from benchmarks.schema import Results
from disk import whole_file
from paravol.debrief.page import TEMPLATES as DEBRIEF
from paravol.debrief.page import colours

TEMPLATES = Path(__file__).parent / "templates"


def html_page(results: Results) -> str:
    """Return the whole HTML file; the same results give the same text."""
    environment = Environment(
        # the debrief's style sheet, and what only this page has
        loader=FileSystemLoader([TEMPLATES, DEBRIEF]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    sheets = [
        environment.get_template(name).render(colour=colours())
        for name in ("page.css", "report.css")
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
