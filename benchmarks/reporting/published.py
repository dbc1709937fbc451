"""The results that the documents quote, and the documents, all written together."""

from pathlib import Path

from benchmarks.machine import ROOT
from benchmarks.reporting.pages import measurements_page
from benchmarks.reporting.quotes import filled
from benchmarks.schema import Results, load_results, save_results
from disk import UserError, whole_file

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

    Raises ValueError for no results, and where there is no checkout to write into.
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
