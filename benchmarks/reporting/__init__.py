"""What a visitor reads of the results: one page, and what the documents quote of it.

`survey` puts rows into sections; `html_page` and `markdown_page` write these out.
"""

from benchmarks.reporting.html_page import write_report
from benchmarks.reporting.published import write_documents

__all__ = ["write_documents", "write_report"]
