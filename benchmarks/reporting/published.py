"""The results that the documents quote, and the documents, all written together."""

from pathlib import Path

from benchmarks.machine import ROOT
from benchmarks.reporting.pages import measurements_page, write_report
from benchmarks.reporting.quotes import filled
from benchmarks.schema import Results, load_results, save_results
from system import UserError, require_place, whole_file

PUBLISHED = ROOT / "benchmarks" / "results" / "published.json"
MEASUREMENTS, README = "docs/measurements.md", "README.md"


def documents(results: Results, root: Path = ROOT) -> dict[Path, str]:
    """Return what each document says, by its file, for these results."""
    readme = root / README
    return {
        root / MEASUREMENTS: measurements_page(results),
        readme: filled(readme.read_text("utf-8"), results),
    }


def write_documents(
    results: Results, root: Path = ROOT, published: Path = PUBLISHED
) -> list[Path]:
    """Keep the results beside the sources and write what quotes them; give the files.

    Raises UserError for no results, and where there is no checkout to write into.
    """
    if not results.rows:
        raise UserError("there are no results to quote")
    if not (root / README).is_file() or not (root / MEASUREMENTS).parent.is_dir():
        raise UserError(f"{root} is no checkout: it has no {README} or no docs")
    save_results(results, published)
    # from the file, so that a later check of it finds the same
    said = documents(load_results(published), root)
    for path, text in said.items():
        with whole_file(path) as beside:
            beside.write_text(text, encoding="utf-8")
    return [published, *said]


def report_results(
    results: Path, page: Path | None = None, *, write_docs: bool = False
) -> list[str]:
    """Write the page of a results file, beside it or where asked; say what was written.

    write_docs: see `write_documents`, too. Raises UserError where there is no file.
    """
    page = page or results.with_name("report.html")
    require_place(page)
    if not results.is_file():
        raise UserError(f"{results} is not there; paravol bench makes it")
    found = load_results(results)
    told = [f"{write_report(found, page)}: {len(found.rows)} rows in one file."]
    if write_docs:
        told += map(str, write_documents(found))
    return told
