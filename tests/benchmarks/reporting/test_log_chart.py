"""A chart has its points where their logarithms are."""

import math
import re
from itertools import pairwise
from xml.etree import ElementTree

import pytest

from benchmarks.reporting.log_chart import (
    Axis,
    Curve,
    Point,
    log_chart,
    styles,
)

SVG = "{http://www.w3.org/2000/svg}"


def drawn(
    curves: list[Curve], slopes: tuple[tuple[float, str], ...] = ()
) -> ElementTree.Element:
    text = log_chart("title", "across", "up", curves, slopes=slopes)
    return ElementTree.fromstring(str(text))


def test_equal_ratios_are_equal_distances() -> None:
    axis = Axis.around("s", [1.0, 1000.0])
    places = [axis.share(10.0**n) for n in range(4)]
    steps = [b - a for a, b in pairwise(places)]
    assert steps == pytest.approx([steps[0]] * 3)
    assert 0 < places[0] < places[-1] < 1
    assert axis.ticks() == [1.0, 10.0, 100.0, 1000.0]


def test_one_value_alone_has_an_axis() -> None:
    axis = Axis.around("s", [3.0])
    assert axis.low < 3.0 < axis.high
    assert all(axis.low <= tick <= axis.high for tick in axis.ticks())


def test_every_point_is_drawn_and_told() -> None:
    points = [Point(2.0**n, 4.0**-n, f"point {n}") for n in range(5)]
    root = drawn([Curve("ART", points)])
    circles = [
        c for c in root.iter(f"{SVG}circle") if c.find(f"{SVG}title") is not None
    ]
    assert [c.findtext(f"{SVG}title") for c in circles] == [p.told for p in points]
    x = [float(c.attrib["cx"]) for c in circles]
    assert [b - a for a, b in pairwise(x)] == pytest.approx([x[1] - x[0]] * 4, abs=0.02)


def test_a_guide_has_its_slope() -> None:
    points = [Point(1.0, 1.0, ""), Point(100.0, 1e-4, "")]
    root = drawn([Curve("ART", points)], slopes=((-2.0, "order 2"),))
    (guide,) = [p for p in root.iter(f"{SVG}path") if p.get("class") == "guide"]
    # the key's lines are filled by no word of theirs
    (curve,) = [p for p in root.iter(f"{SVG}path") if p.get("fill") == "none"]
    assert direction(guide) == pytest.approx(direction(curve), abs=0.01)


def direction(path: ElementTree.Element) -> float:
    x0, y0, x1, y1 = map(float, re.findall(r"-?[\d.]+", path.attrib["d"]))
    return math.atan2(y1 - y0, x1 - x0)


def test_series_of_one_maker_can_be_told_apart() -> None:
    names = [
        f"{maker} {n}" for maker in ("ART", "FSR", "VTK", "other") for n in range(3)
    ]
    found = styles(names)
    assert len(set(found)) == len(names)


def test_words_are_escaped() -> None:
    root = drawn([Curve("<b>&", [Point(1, 1, "<i>")])])
    assert "<b>&" in [text.text for text in root.iter(f"{SVG}text")]
