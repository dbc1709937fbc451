"""The page tells every figure, and why one is missing."""

import numpy as np

from benchmarks.gallery.gallery_page import gallery_page, picture_name
from benchmarks.gallery.panel import Absent, Family, Panel
from tests.benchmarks.conftest import HERE

FAMILY = Family("test", "Title", ("ours", "theirs"), "the best", "codes", "Told.")
PIXELS = np.zeros((4, 4, 3), np.uint8)


def made(cpu_s: float | None, error: float, why: str = "") -> Panel:
    return Panel("theirs", PIXELS, cpu_s, error, 0.9, why)


def test_medians_are_of_right_pictures_only() -> None:
    ours = Panel("ours", PIXELS, 0.001, 0.25, 0.8)
    rows = {
        "a": [ours, made(0.002, 1.0)],
        "b": [ours, made(0.004, 3.0)],
        "c": [ours, made(None, 99.0, "wrong colours")],
    }
    page = gallery_page({FAMILY: rows}, HERE, 64)
    assert "| theirs | 2 of 3 | 3 ms | 2 | 3 | 0.900 |" in page
    assert "| c | 1 ms; 0.25; 0.800 | not right; 99; 0.900 |" in page
    assert "- theirs, c: wrong colours" in page
    assert f"](pictures/{picture_name(FAMILY)})" in page


def test_what_is_absent_everywhere_is_told_once() -> None:
    gone = Absent("theirs", "no LLVM here")
    ours = Panel("ours", PIXELS, 0.001, 0.25, 0.8)
    page = gallery_page({FAMILY: {"a": [ours, gone], "b": [ours, gone]}}, HERE, 64)
    assert page.count("no LLVM here") == 1
    assert "theirs is absent in every view: no LLVM here" in page
    assert "| theirs | 0 of 2 | - | - | - | - |" in page
