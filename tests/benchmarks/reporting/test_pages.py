"""Pages say what the sections say; the HTML one stands alone and fits its window."""

import re
import shutil
import subprocess
from pathlib import Path

import msgspec
import pytest
from PIL import Image

from benchmarks.reporting.pages import (
    html_page,
    markdown_table,
    measurements_page,
    write_report,
)
from benchmarks.reporting.published import PUBLISHED
from benchmarks.reporting.section import Table
from benchmarks.reporting.survey import survey
from benchmarks.schema import Results, Times, load_results
from tests.benchmarks.reporting.conftest import HOSTILE
from tests.paravol.debrief.test_page import Page

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium-headless-shell", "chromium"))), None
)


def test_the_page_is_well_formed_and_stands_alone(results: Results) -> None:
    text = html_page(results)
    page = Page(text)
    assert page.open == []
    assert page.all("script") == []
    assert not re.search(r"https?:|url\(|@import", text)
    for tag, attributes in page.tags:
        for name in ("src", "href", "srcset", "action", "data"):
            assert (attributes.get(name) or "#").startswith(("#", "data:")), tag
    places = [a["id"] for _, a in page.tags if "id" in a]
    assert len(set(places)) == len(places)
    links = {(a["href"] or "").removeprefix("#") for a in page.all("a")}
    assert links <= set(places)


def test_words_of_a_file_are_no_markup(results: Results) -> None:
    text = html_page(results)
    assert HOSTILE not in text
    assert any(HOSTILE in words for words in Page(text).words)


def test_charts_and_tables_have_words(results: Results) -> None:
    page = Page(html_page(results))
    charts = page.all("img")
    assert len(charts) == 3
    assert all(a.get("alt") for a in charts)
    wide = [a for a in page.all("div") if a.get("class") == "wide"]
    assert all(a.get("tabindex") == "0" and a.get("aria-label") for a in wide)
    said = " ".join(page.words)
    for wrong in (" nan ", "NaN", "None", " inf "):
        assert wrong not in said


def test_the_page_is_written_as_a_whole(results: Results, tmp_path: Path) -> None:
    path = write_report(results, tmp_path / "deep" / "report.html")
    assert path.read_text("utf-8") == html_page(results)
    assert [file.name for file in path.parent.iterdir()] == ["report.html"]


def test_no_results_are_a_page_that_says_so() -> None:
    said = " ".join(Page(html_page(Results())).words)
    assert "Nothing was measured." in said


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
@pytest.mark.parametrize("width", [1280, 390])
def test_a_browser_shows_it_without_complaint_or_scrolling_sideways(
    tmp_path: Path, width: int
) -> None:
    """The committed results, with all parts opened."""
    told = (
        "<script>document.querySelectorAll('details').forEach(d => d.open = true);"
        "document.title = document.documentElement.scrollWidth</script>"
    )
    text = html_page(load_results(PUBLISHED))
    # The page's policy lets no script run: the test's own needs leave.
    policy = "style-src 'unsafe-inline'"
    assert policy in text
    text = text.replace(policy, f"{policy}; script-src 'unsafe-inline'")
    file, picture = tmp_path / "page.html", tmp_path / "page.png"
    file.write_text(text.replace("</body>", f"{told}</body>"), "utf-8")
    assert CHROMIUM is not None
    done = subprocess.run(
        [
            *(CHROMIUM, "--no-sandbox", "--disable-gpu", "--hide-scrollbars"),
            *("--enable-logging=stderr", "--v=0"),
            *(f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900"),
            *(f"--screenshot={picture}", "--dump-dom", file.as_uri()),
        ],
        check=True,
        timeout=120,
        capture_output=True,
        text=True,
    )
    assert "CONSOLE" not in done.stderr
    with Image.open(picture) as image:
        assert image.size == (width, 900)
        colours = image.convert("RGB").getcolors(1 << 24)
    assert colours is not None
    assert len(colours) > 20
    found = re.search(r"<title>(\d+)</title>", done.stdout)
    assert found is not None
    assert int(found[1]) <= width


def tables(page: str) -> list[list[str]]:
    """Give the cells of every line of every table."""
    lines = [line for line in page.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


def test_every_section_and_every_row_is_told(results: Results) -> None:
    page = measurements_page(results)
    for section in survey(results):
        assert page.count(f"## {section.title}\n") == 1
    modes = [cells[0] for cells in tables(page)]
    for row in results.rows:
        assert row.mode.replace("<", r"\<") in modes


def test_a_disturbed_row_is_marked(results: Results) -> None:
    noisy = msgspec.structs.replace(results.rows[0], time_s=Times(min=1.5, median=2.5))
    assert "| ~1.5 s |" in measurements_page(Results(rows=[noisy]))


def test_words_make_no_columns_and_no_markup() -> None:
    table = Table("", ("a", "b"), [("x|y", "<b>*")], frozenset({0}))
    assert markdown_table(table).splitlines() == [
        "| a | b |",
        "| --- | ---: |",
        r"| x\|y | \<b>\* |",
    ]
