"""Charts whose axes are both logarithmic, drawn element by element."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from paravol.debrief.svg import Figure, element, path_data

WIDTH, HEIGHT = 440.0, 310.0
LEFT, RIGHT, TOP, BOTTOM = 62.0, 14.0, 10.0, 42.0
KEY_LINE, KEY_COLUMN = 18.0, 214.0
SHORT_NAME = 27
"""Letters of a name that has room in one of two columns of the key."""

FAMILIES = {
    "ART": ("#a3151f", "#a14a00", "#7a3d8c", "#d0434d", "#5c1010"),
    "FSR": ("#0b4f9e", "#1a6b3c", "#3b86c9", "#0f7f86"),
    "VTK": ("#1b1f24", "#6b7480", "#454c54"),
}
OTHERS = ("#8a6100", "#545d68", "#7b8490", "#3f5f2a", "#6a4a8a")
"""Colours of series by who made them. Markers and dashes tell again what they tell."""

DASHES = None, "7 3", "2 3", "9 3 2 3", "14 4", "4 4"
MARKERS = "circle", "square", "diamond", "triangle"


@dataclass(frozen=True, slots=True)
class Point:
    """Hold a place, and what is told of it where the pointer rests."""

    x: float
    y: float
    told: str


@dataclass(frozen=True, slots=True)
class Curve:
    """Hold a series. is_line: its points are joined."""

    name: str
    points: Sequence[Point]
    is_line: bool = True


@dataclass(frozen=True, slots=True)
class Axis:
    """Say what an axis counts; `low` and `high` are its ends, above 0."""

    name: str
    low: float
    high: float

    @classmethod
    def around(cls, name: str, values: Sequence[float]) -> "Axis":
        """Leave some room about the values."""
        low, high = min(values), max(values)
        room = max((high / low) ** 0.12, 1.25)
        return cls(name, low / room, high * room)

    def share(self, value: float) -> float:
        """Return where a value lies, 0 to 1 between the ends."""
        return math.log(value / self.low) / math.log(self.high / self.low)

    def ticks(self) -> list[float]:
        """Return round values: decades, with 2 and 5 where these are few."""
        first, last = math.floor(math.log10(self.low)), math.ceil(math.log10(self.high))
        few = math.log10(self.high / self.low) < 2.5
        marks = (1, 2, 5) if few else (1,)
        every = [m * 10.0**n for n in range(first, last + 1) for m in marks]
        return [value for value in every if self.low <= value <= self.high]


def log_chart(
    title: str,
    across: str,
    up: str,
    curves: Sequence[Curve],
    *,
    front: Sequence[tuple[float, float]] = (),
    slopes: Sequence[tuple[float, str]] = (),
) -> Markup:
    """Draw curves. front: its corners, fastest first. slopes: guides with their words.

    Raises ValueError where there is no point.
    """
    points = [point for curve in curves for point in curve.points]
    x = Axis.around(across, [point.x for point in points])
    y = Axis.around(up, [point.y for point in points])
    names = [curve.name for curve in curves]
    lines = math.ceil((len(names) + bool(front)) / _key_columns(names))
    height = HEIGHT + 8 + KEY_LINE * lines
    told = f"{len(points)} points of {len(curves)} series; {up} against {across}."
    figure = Figure(WIDTH, height, title, told)
    _frame(figure, x, y)
    for slope, name in slopes:
        _guide(figure, x, y, slope, name)
    if front:
        _front(figure, x, y, front)
    for curve, style in zip(curves, styles(names), strict=True):
        _curve(figure, x, y, curve, style)
    _key(figure, names, has_front=bool(front))
    return figure.markup()


@dataclass(frozen=True, slots=True)
class Style:
    """Hold how a series looks."""

    colour: str
    marker: str
    dash: str | None


def styles(names: Sequence[str]) -> list[Style]:
    """Give each series a look of its own, alike for the same maker."""
    found, counts = [], dict.fromkeys((*FAMILIES, ""), 0)
    for name in names:
        family = name.partition(" ")[0].rstrip(",")
        family = family if family in FAMILIES else ""
        colours = FAMILIES.get(family, OTHERS)
        n = counts[family]
        counts[family] += 1
        found.append(
            Style(
                colours[n % len(colours)],
                MARKERS[n % len(MARKERS)],
                DASHES[n % len(DASHES)],
            )
        )
    return found


def _place(x: Axis, y: Axis, at: tuple[float, float]) -> tuple[float, float]:
    return (
        LEFT + x.share(at[0]) * (WIDTH - LEFT - RIGHT),
        HEIGHT - BOTTOM - y.share(at[1]) * (HEIGHT - BOTTOM - TOP),
    )


def _frame(figure: Figure, x: Axis, y: Axis) -> None:
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    figure.add(
        "rect", x=LEFT, y=TOP, width=right - LEFT, height=bottom - TOP, class_="frame"
    )
    for value in x.ticks():
        across, _ = _place(x, y, (value, y.low))
        figure.add(
            "path", d=path_data([(across, TOP), (across, bottom)]), class_="grid"
        )
        figure.label(across, bottom + 15, f"{value:g}", kind="small", anchor="middle")
    for value in y.ticks():
        _, up = _place(x, y, (x.low, value))
        figure.add("path", d=path_data([(LEFT, up), (right, up)]), class_="grid")
        figure.label(LEFT - 6, up + 4, f"{value:g}", kind="small", anchor="end")
    middle = (LEFT + right) / 2
    figure.label(middle, bottom + 34, x.name, kind="small", anchor="middle")
    turned = f"rotate(-90 12 {(TOP + bottom) / 2:.0f})"
    figure.add(
        "text",
        y.name,
        x=12,
        y=(TOP + bottom) / 2,
        text_anchor="middle",
        class_="small",
        transform=turned,
    )


def _guide(figure: Figure, x: Axis, y: Axis, slope: float, name: str) -> None:
    """Draw a power through the middle, as far as the frame reaches."""
    middle = math.sqrt(x.low * x.high), math.sqrt(y.low * y.high)
    reach = [(x.low / middle[0], x.high / middle[0])]
    if slope:
        ends = sorted((end / middle[1]) ** (1 / slope) for end in (y.low, y.high))
        reach.append((ends[0], ends[1]))
    ends_of = max(low for low, _ in reach), min(high for _, high in reach)
    line = [_place(x, y, (middle[0] * t, middle[1] * t**slope)) for t in ends_of]
    figure.add("path", d=path_data(line), class_="guide")
    across, up = line[1]
    steps_out = up < TOP + 20 or up > HEIGHT - BOTTOM - 14
    figure.label(
        across - 6,
        min(max(up, TOP + 14), HEIGHT - BOTTOM - 6) - (0 if steps_out else 6),
        name,
        kind="small",
        anchor="end",
    )


def _front(
    figure: Figure, x: Axis, y: Axis, corners: Sequence[tuple[float, float]]
) -> None:
    """Draw the border of what is reached: down at a row, then across to the next."""
    at = [(corners[0][0], y.high)]
    for seconds, error in corners:
        at += [(seconds, at[-1][1]), (seconds, error)]
    at.append((x.high, at[-1][1]))
    places = [_place(x, y, place) for place in at]
    figure.add("path", d=path_data(places), class_="front")


def _curve(figure: Figure, x: Axis, y: Axis, curve: Curve, style: Style) -> None:
    places = [_place(x, y, (point.x, point.y)) for point in curve.points]
    if curve.is_line and len(places) > 1:
        figure.add(
            "path",
            d=path_data(places),
            fill="none",
            stroke=style.colour,
            stroke_width=1.6,
            stroke_dasharray=style.dash,
        )
    for place, point in zip(places, curve.points, strict=True):
        figure.parts.append(_marker(*place, style, point.told))


def _marker(x: float, y: float, style: Style, told: str) -> Markup:
    inside = element("title", told) if told else ""
    fill = style.colour
    if style.marker == "circle":
        return element("circle", inside, cx=x, cy=y, r=4.0, fill=fill)
    shapes = {
        "square": ((-3.6, -3.6), (3.6, -3.6), (3.6, 3.6), (-3.6, 3.6)),
        "diamond": ((0, -5.2), (5.2, 0), (0, 5.2), (-5.2, 0)),
        "triangle": ((0, -4.8), (4.8, 3.9), (-4.8, 3.9)),
    }
    corners = " ".join(
        f"{x + right:.1f},{y + down:.1f}" for right, down in shapes[style.marker]
    )
    return element("polygon", inside, points=corners, fill=fill)


def _key(figure: Figure, names: Sequence[str], *, has_front: bool) -> None:
    """Tell the series below the chart."""
    columns = _key_columns(names)
    for n, (name, style) in enumerate(zip(names, styles(names), strict=True)):
        left, line = _key_place(n, columns)
        figure.add(
            "path",
            d=path_data([(left, line - 4), (left + 24, line - 4)]),
            stroke=style.colour,
            stroke_width=1.6,
            stroke_dasharray=style.dash,
        )
        figure.parts.append(_marker(left + 12, line - 4, style, ""))
        figure.label(left + 30, line, name, kind="small")
    if has_front:
        left, line = _key_place(len(names), columns)
        ends = [(left, line - 4), (left + 24, line - 4)]
        figure.add("path", d=path_data(ends), class_="front")
        figure.label(left + 30, line, "front", kind="small")


def _key_columns(names: Sequence[str]) -> int:
    return 2 if max(map(len, names)) <= SHORT_NAME else 1


def _key_place(number: int, columns: int) -> tuple[float, float]:
    line, column = divmod(number, columns)
    return 8 + KEY_COLUMN * column, HEIGHT + 16 + KEY_LINE * line
