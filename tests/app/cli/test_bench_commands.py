"""`paravol bench report` writes the page where it says; documents only when asked."""

from pathlib import Path

import pytest

from app.cli.bench_commands import report
from benchmarks.schema import Results, save_results


def test_the_page_stands_beside_the_results_or_where_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "results.json"
    save_results(Results(), results)
    assert report(results) == 0
    assert (tmp_path / "report.html").read_text("utf-8").startswith("<!DOCTYPE html>")
    assert f"{tmp_path / 'report.html'}: 0 rows" in capsys.readouterr().out
    report(results, out=tmp_path / "other.html")
    assert (tmp_path / "other.html").is_file()


def test_no_results_write_no_page_and_no_documents(tmp_path: Path) -> None:
    results = tmp_path / "results.json"
    with pytest.raises(ValueError, match=r"results\.json is not there"):
        report(results, write_docs=True)
    assert list(tmp_path.iterdir()) == []
    save_results(Results(), results)
    with pytest.raises(ValueError, match="no results to quote"):
        report(results, write_docs=True)
