"""`paravol bench report`: write the page, and the documents that quote it."""

from pathlib import Path

from benchmarks.reporting import write_documents, write_report
from benchmarks.schema import load_results
from disk import UserError, demand_place


def run_report(results: Path, out: Path | None, *, write_docs: bool) -> int:
    """Write the page; raises ValueError for no results."""
    page = out or results.with_name("report.html")
    demand_place(page)
    if not results.is_file():
        raise UserError(f"{results} is not there; paravol bench makes it")
    found = load_results(results)
    print(f"{write_report(found, page)}: {len(found.rows)} rows in one file.")
    if write_docs:
        for path in write_documents(found):
            print(path)
    return 0
