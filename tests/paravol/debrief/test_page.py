"""The page stands alone, is well formed, and takes no word of a file for markup."""

import re
import shutil
import subprocess
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import pytest
from PIL import Image

from tests.paravol.debrief.conftest import HOSTILE, Recorded

VOID = {"meta", "img", "br", "link", "input", "hr"}
CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium-headless-shell", "chromium"))), None
)


class Page(HTMLParser):
    """Gather what the laws are about."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def page(recorded: Recorded) -> Page:
    return Page(recorded.text)


def test_every_element_is_closed_in_its_order(page: Page) -> None:
    assert page.open == []


def test_headings_go_down_one_by_one(page: Page) -> None:
    levels = [int(tag[1]) for tag, _ in page.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    pairs = pairwise(levels)
    assert all(after <= before + 1 for before, after in pairs)


def test_every_link_leads_to_a_place_that_is_there_once(page: Page) -> None:
    places = [a["id"] for _, a in page.tags if "id" in a]
    assert len(set(places)) == len(places)
    links = [a["href"] or "" for a in page.all("a")]
    assert len(links) > 15
    assert {link.removeprefix("#") for link in links} <= set(places)
    assert any(link.startswith("#event-") for link in links)


def test_nothing_is_fetched_from_anywhere(recorded: Recorded, page: Page) -> None:
    for tag, attributes in page.tags:
        for name in ("src", "href", "srcset", "action", "data"):
            value = attributes.get(name) or "#"
            assert value.startswith(("#", "data:image/jpeg;base64,")), (tag, name)
    rest = recorded.text.replace("http://www.w3.org/2000/svg", "")
    assert not re.search(r"https?:|url\(|@import", rest)
    (policy,) = [a for a in page.all("meta") if "http-equiv" in a]
    assert (policy["content"] or "").startswith("default-src 'none'")


def test_no_word_of_a_file_becomes_markup(recorded: Recorded, page: Page) -> None:
    assert HOSTILE not in recorded.text
    assert len(page.all("script")) == 1
    assert any(HOSTILE in words for words in page.words)
    assert not [a for _, a in page.tags for name in a if name.startswith("on")]


def test_pictures_and_figures_have_words(page: Page) -> None:
    assert all(a.get("alt") for a in page.all("img"))
    figures = page.all("svg")
    assert len(figures) >= 5
    assert all(a.get("aria-label") and a.get("role") for a in figures)


def test_what_scrolls_can_be_reached_by_keys(page: Page) -> None:
    wide = [a for a in page.all("div") if a.get("class") == "wide"]
    assert wide
    assert all(a.get("tabindex") == "0" and a.get("aria-label") for a in wide)


def test_parts_without_data_say_so(recorded: Recorded, page: Page) -> None:
    said = " ".join(page.words)
    assert "No site was seen." in said
    assert "No pictures were drawn." in said
    assert "its pictures were not drawn" in said
    assert "NaN" not in said
    assert " nan" not in said
    assert "None" not in said


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium")
@pytest.mark.parametrize("width", [1280, 390])
def test_a_browser_shows_it_without_scrolling_sideways(
    recorded: Recorded, tmp_path: Path, width: int
) -> None:
    # the script of the test tells the width of what is there in the page's title
    told = "<script>document.title = document.documentElement.scrollWidth</script>"
    file, picture = tmp_path / "page.html", tmp_path / "page.png"
    # as wide as the coverage is drawn
    dot = "data:image/gif;base64,R0lGODlhAQABAAAAACwAAAAAAQABAAA="
    wide = f'<figure><img src="{dot}" width="2400" height="9" alt="wide"></figure>'
    text = recorded.text.replace("</section>", f"{wide}</section>")
    file.write_text(text.replace("</body>", f"{told}</body>"), "utf-8")
    assert CHROMIUM is not None
    dumped = subprocess.run(
        [
            *(CHROMIUM, "--no-sandbox", "--disable-gpu", "--hide-scrollbars"),
            *(f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900"),
            *(f"--screenshot={picture}", "--dump-dom", file.as_uri()),
        ],
        check=True,
        timeout=120,
        capture_output=True,
        text=True,
    ).stdout
    with Image.open(picture) as image:
        assert image.size == (width, 900)
        colours = image.convert("RGB").getcolors(1 << 24)
    assert colours is not None
    assert len(colours) > 20
    found = re.search(r"<title>(\d+)</title>", dumped)
    assert found is not None
    assert int(found[1]) <= width
