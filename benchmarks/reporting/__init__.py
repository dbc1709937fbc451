"""What a visitor reads of the results: one page, and what the documents quote of it.

`survey` puts rows into sections; `pages` writes these out.
"""

from benchmarks.reporting.pages import write_report
from benchmarks.reporting.published import report_results, write_documents

__all__ = ["report_results", "write_documents", "write_report"]
