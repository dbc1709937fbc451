"""The committed documents are what the committed results make of them."""

from pathlib import Path

import pytest

from benchmarks.reporting.published import (
    MEASUREMENTS,
    PUBLISHED,
    README,
    documents,
    write_documents,
)
from benchmarks.reporting.quotes import BEGIN, END
from benchmarks.schema import Results, load_results


def test_committed_documents_say_what_the_committed_results_say() -> None:
    results = load_results(PUBLISHED)
    assert results.rows
    for path, text in documents(results).items():
        assert path.read_text("utf-8") == text, (
            f"{path.name} is not what `paravol bench report --write-docs` writes"
        )


def test_the_committed_results_are_small() -> None:
    """A row a line, so that a change can be read; no more than a picture's bytes."""
    assert PUBLISHED.stat().st_size < 1_000_000


def test_documents_are_written_with_the_results_they_quote(
    results: Results, tmp_path: Path
) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / README).write_text(f"# A\n\n{BEGIN}\n{END}\n")
    kept = tmp_path / "kept.json"
    files = write_documents(results, tmp_path, kept)
    assert set(files) == {kept, tmp_path / README, tmp_path / MEASUREMENTS}
    assert load_results(kept) == results
    for path, text in documents(load_results(kept), tmp_path).items():
        assert path.read_text("utf-8") == text


def test_no_checkout_and_no_results_are_told(results: Results, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no checkout"):
        write_documents(results, tmp_path, tmp_path / "kept.json")
    with pytest.raises(ValueError, match="no results"):
        write_documents(Results(), tmp_path, tmp_path / "kept.json")
    assert list(tmp_path.iterdir()) == []
