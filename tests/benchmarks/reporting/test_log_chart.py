"""A chart has its points where their logarithms are."""

import base64
from xml.etree import ElementTree

import numpy as np
import pytest

from benchmarks.reporting.log_chart import Curve, log_chart, log_figure, styles

SVG = "{http://www.w3.org/2000/svg}"
POINTS = [(2.0**n, 4.0**-n) for n in range(5)]


def test_equal_ratios_are_equal_distances_and_every_point_is_drawn() -> None:
    (axes,) = log_figure("s", "up", [Curve("ART", POINTS)]).axes
    (curve,) = axes.lines
    assert curve.get_xydata().tolist() == [list(point) for point in POINTS]
    places = axes.transData.transform(POINTS)
    steps = np.diff(places, axis=0)
    assert steps == pytest.approx(np.broadcast_to(steps[0], steps.shape))
    assert axes.bbox.contains(*places[0])
    assert axes.bbox.contains(*places[-1])


def test_a_guide_has_its_slope() -> None:
    curve = Curve("ART", [(1.0, 1.0), (100.0, 1e-4)])
    (axes,) = log_figure("s", "up", [curve], slopes=((-2.0, "order 2"),)).axes
    x, y = np.log(axes.lines[1].get_xydata()).T
    assert np.diff(y) / np.diff(x) == pytest.approx(-2.0)
    assert axes.get_xlim() == pytest.approx(np.exp(x))


def test_the_front_goes_down_at_a_row_then_across_to_the_next() -> None:
    front = [(1.0, 0.1), (4.0, 0.01)]
    (axes,) = log_figure("s", "up", [Curve("ART", front)], front=front).axes
    border = axes.lines[-1]
    assert border.get_drawstyle() == "steps-post"
    top, right = axes.get_ylim()[1], axes.get_xlim()[1]
    corners = [[1.0, top], [1.0, 0.1], [4.0, 0.01], [right, 0.01]]
    assert border.get_xydata() == pytest.approx(np.array(corners))


def test_series_of_one_maker_can_be_told_apart() -> None:
    names = [
        f"{maker} {n}" for maker in ("ART", "FSR", "VTK", "other") for n in range(6)
    ]
    found = {(look["color"], look["marker"]) for look in styles(names)}
    assert len(found) == len(names)


def test_the_same_curves_give_the_same_text_with_their_words_escaped() -> None:
    curves = [Curve("<b>&", [(1.0, 1.0)])]
    first, second = (log_chart("across", "up", curves) for _ in range(2))
    assert first == second
    head, _, text = first.partition(",")
    assert head == "data:image/svg+xml;base64"
    root = ElementTree.fromstring(base64.b64decode(text))
    words = [node.text for node in root.iter(f"{SVG}text")]
    assert {"<b>&", "across", "up"} <= set(words)
