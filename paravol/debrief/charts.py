"""The page's figures: timeline, hazards over time, the path in three planes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from paravol.debrief.colours import HAZARD_LINES, Colour
from paravol.debrief.events import Event, Kind
from paravol.debrief.findings import Findings
from paravol.debrief.svg import Figure, element, path_data

WIDTH, LEFT, RIGHT = 960.0, 118.0, 14.0
LANE, BAR = 30.0, 14.0
LEAST_BAR = 5.0
"""Width of the mark of something that was over at once."""

DASHES = None, "7 3", "2 3", "9 3 2 3", "14 4", "4 4", "1 4", "12 3 2 3 2 3"
CLIPPED_MM = 20.0
"""Hazards farther away than this are all alike."""

MOST_HAZARDS = len(HAZARD_LINES)
MOST_POINTS = 600

LANE_COLOURS = {
    Kind.TASK: Colour.TASK,
    Kind.INJURY: Colour.DANGER,
    Kind.BREAK: Colour.DANGER,
    Kind.HAZARD: Colour.WARNING,
    Kind.CUT: Colour.CUT,
    Kind.CONTACT: Colour.CONTACT,
    Kind.FROZEN: Colour.FROZEN,
    Kind.SCOPE: Colour.OWN,
    Kind.DEVICE: Colour.FROZEN,
    Kind.AID: Colour.QUIET,
    Kind.SNAPSHOT: Colour.OWN,
    Kind.MOMENT: Colour.OWN,
}

MOMENTS = Kind.DEVICE, Kind.SCOPE, Kind.AID, Kind.SNAPSHOT, Kind.MOMENT
"""Kinds that last no time."""

AXES = ("right to left", "front to back", "down to up")
PLANES = (
    ("From the front", 0, 2, ("R", "L"), ("S", "I")),
    ("From the right", 1, 2, ("A", "P"), ("S", "I")),
    ("From below", 0, 1, ("R", "L"), ("A", "P")),
)
"""Title, the axes of LPS across and up, letters at the ends left and right, top and
bottom."""


@dataclass(frozen=True, slots=True)
class _Scale:
    """Turn seconds of the session into places across a figure."""

    begin_s: float
    end_s: float

    def __call__(self, time_s: float) -> float:
        length_s = max(self.end_s - self.begin_s, 1e-9)
        return LEFT + (time_s - self.begin_s) / length_s * (WIDTH - LEFT - RIGHT)

    def ticks(self) -> list[float]:
        """Return eight or so round times."""
        rough = max((self.end_s - self.begin_s) / 8, 1e-3)
        power = 10.0 ** math.floor(math.log10(rough))
        step = next(s * power for s in (1, 2, 5, 10) if s * power >= rough)
        first = math.ceil(self.begin_s / step)
        return [n * step for n in range(first, int(self.end_s / step + 1e-9) + 1)]


def timeline(findings: Findings, events: Sequence[Event]) -> Markup:
    """Draw a lane for each kind of event, with links to their entries, and blood."""
    scale = _Scale(findings.begin_s, findings.end_s)
    lanes = [kind for kind in Kind if any(e.kind is kind for e in events)]
    blood = findings.followed.blood
    has_blood = bool(blood) and blood[-1][1] > 0.0
    height = LANE * (len(lanes) + 2 * has_blood) + 40.0
    told = ", ".join(f"{kind} {sum(e.kind is kind for e in events)}" for kind in lanes)
    figure = Figure(
        WIDTH,
        height,
        "What happened when",
        f"{findings.end_s - findings.begin_s:.0f} seconds; {told or 'no events'}.",
        has_links=True,
    )
    bottom = height - 30.0
    _time_axis(figure, scale, 6.0, bottom)
    for row, kind in enumerate(lanes):
        top = 8.0 + LANE * row
        figure.label(LEFT - 8, top + 15, kind, anchor="end")
        for event in events:
            if event.kind is kind:
                figure.parts.append(_mark(event, scale, top))
    if has_blood:
        _blood(figure, blood, scale, bottom)
    return figure.markup()


def _mark(event: Event, scale: _Scale, top: float) -> Markup:
    begin, end = scale(event.begin_s), scale(event.end_s)
    colour = LANE_COLOURS[event.kind]
    told = element("title", f"{event.shown_s:.1f} s: {event.title}. {event.detail}")
    x, y = begin, top + BAR / 2 + 3
    if event.kind in (Kind.INJURY, Kind.BREAK):
        points = f"{x},{y - 9} {x + 8},{y} {x},{y + 9} {x - 8},{y}"
        shape = element("polygon", told, points=points, fill=colour)
    elif event.kind in MOMENTS:
        shape = element("circle", told, cx=begin, cy=y, r=6, fill=colour)
    else:
        shape = element(
            "rect",
            told,
            x=begin,
            y=top + 3,
            width=max(end - begin, LEAST_BAR),
            height=BAR,
            rx=2,
            fill=colour,
            fill_opacity=None if event.is_told else 0.55,
        )
    if not event.is_told:
        return shape
    name = f"{event.title}, {event.shown_s:.1f} s"
    return element("a", shape, href=f"#{event.anchor}", aria_label=name)


def _blood(
    figure: Figure, blood: Sequence[tuple[float, float]], scale: _Scale, bottom: float
) -> None:
    """Draw how much had bled as a rising area above the axis."""
    most_ml = blood[-1][1]
    top = bottom - 2 * LANE + 8
    points = [(scale(t), bottom - (bottom - top) * ml / most_ml) for t, ml in blood]
    closed = [(points[0][0], bottom), *points, (points[-1][0], bottom)]
    figure.add("path", d=path_data(closed) + "Z", fill=Colour.BLOOD, fill_opacity=0.25)
    figure.add("path", d=path_data(points), fill="none", stroke=Colour.BLOOD)
    figure.label(LEFT - 8, bottom - 22, "blood", anchor="end")
    figure.label(LEFT - 8, bottom - 6, f"{most_ml:.1f} mL", kind="small", anchor="end")


def _time_axis(figure: Figure, scale: _Scale, top: float, bottom: float) -> None:
    for time_s in scale.ticks():
        x = scale(time_s)
        figure.add("path", d=f"M{x:.1f},{top}V{bottom}", class_="grid")
        figure.label(x, bottom + 18, f"{time_s:g} s", kind="small", anchor="middle")
    figure.add("path", d=f"M{LEFT},{bottom}H{WIDTH - RIGHT}", class_="axis")


def hazards(
    findings: Findings, gaps: Mapping[str, NDArray[np.float64]], margin_mm: float
) -> Markup:
    """Draw how near scope or tool was to the nearest hazards, over time.

    gaps: mm by hazard, at the session's samples. The scale is that of the square root:
    near is drawn larger than far, and all beyond `CLIPPED_MM` alike.
    """
    scale = _Scale(findings.begin_s, findings.end_s)
    top, bottom, key = 10.0, 250.0, 20.0
    height = bottom + 34.0 + key * math.ceil(len(gaps) / 2)
    nearest = ", ".join(f"{name} {np.nanmin(mm):.1f} mm" for name, mm in gaps.items())
    figure = Figure(
        WIDTH, height, "Distance to hazards over time", f"Nearest: {nearest}."
    )
    low = min(0.0, *(float(np.nanmin(mm)) for mm in gaps.values()))
    low = math.floor(max(low, -10.0))

    def at(mm: float) -> float:
        held = min(max(mm, low), CLIPPED_MM)
        root = math.sqrt((held - low) / (CLIPPED_MM - low))
        return bottom - root * (bottom - top)

    figure.add(
        "rect",
        x=LEFT,
        y=at(margin_mm),
        width=WIDTH - LEFT - RIGHT,
        height=at(low) - at(margin_mm),
        class_="margin",
    )
    _time_axis(figure, scale, top, bottom)
    for level in sorted({low, 0.0, 1.0, margin_mm, 5.0, 10.0, CLIPPED_MM}):
        y = at(level)
        figure.add("path", d=f"M{LEFT},{y:.1f}H{WIDTH - RIGHT}", class_="grid")
        word = f"{level:g} mm" + (" +" if level == CLIPPED_MM else "")
        word = f"margin {level:g}" if level == margin_mm else word
        figure.label(LEFT - 8, y + 4, word, kind="small", anchor="end")
    times = np.array(findings.followed.time_s)
    for n, (name, mm) in enumerate(gaps.items()):
        colour, dash = HAZARD_LINES[n % len(HAZARD_LINES)], DASHES[n % len(DASHES)]
        style = {"stroke": colour, "stroke_dasharray": dash, "fill": "none"}
        for points in _lines(times, mm):
            line = [(scale(t), at(d)) for t, d in points]
            figure.add("path", d=path_data(line), stroke_width=1.8, **style)
        x, y = LEFT + (n % 2) * 400, bottom + 44 + key * (n // 2)
        figure.add("path", d=f"M{x},{y - 4}h34", stroke_width=2.5, **style)
        figure.label(x + 42, y, f"{name}: {np.nanmin(mm):.1f} mm at least")
    return figure.markup()


def _lines(
    times: NDArray[np.float64], values: NDArray[np.float64]
) -> list[list[tuple[float, float]]]:
    """Return stretches of known values, thinned so that the least ones stay."""
    known = np.flatnonzero(np.isfinite(values))
    if not len(known):
        return []
    each = max(len(times) // MOST_POINTS, 1)
    found: list[list[tuple[float, float]]] = []
    for part in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
        blocks = np.split(part, range(each, len(part), each))
        lows = [block[np.argmin(values[block])] for block in blocks]
        kept = sorted({int(part[0]), *map(int, lows), int(part[-1])})
        found.append([(float(times[n]), float(values[n])) for n in kept])
    return found


def paths(
    own: Sequence[NDArray[np.float64]],
    other: Sequence[NDArray[np.float64]],
    marks: Sequence[tuple[str, str, NDArray[np.float64]]],
) -> list[Markup]:
    """Draw the tip's way in three planes; R L A P S I say where is what.

    own, other: pieces ``(n, 3)`` LPS mm. marks: anchor, words and place of events.
    """
    whole = np.concatenate([*own, *other])
    low, high = whole.min(axis=0), whole.max(axis=0)
    side_mm = float(max((high - low).max(), 10.0)) * 1.12
    middle = (low + high) / 2
    size, edge = 320.0, 18.0
    per_mm = (size - 2 * edge) / side_mm
    found = []
    for title, across, up, ends, tops in PLANES:
        figure = Figure(
            size,
            size,
            title,
            f"The scope's way, {AXES[across]} {high[across] - low[across]:.0f} mm and "
            f"{AXES[up]} {high[up] - low[up]:.0f} mm.",
            has_links=bool(marks),
        )
        sign = -1.0 if up == 2 else 1.0

        def place(
            points: NDArray[np.float64], a: int = across, b: int = up, s: float = sign
        ) -> NDArray[np.float64]:
            x = size / 2 + (points[..., a] - middle[a]) * per_mm
            y = size / 2 + s * (points[..., b] - middle[b]) * per_mm
            return np.stack([x, y], axis=-1)

        figure.add("rect", x=1, y=1, width=size - 2, height=size - 2, class_="frame")
        for piece in other:
            line = path_data(place(piece).tolist())
            figure.add("path", d=line, class_="other")
        for piece in own:
            figure.add("path", d=path_data(place(piece).tolist()), class_="own")
        begin, end = place(own[0][0]), place(own[-1][-1])
        figure.add(
            "circle", cx=float(begin[0]), cy=float(begin[1]), r=5, class_="begin"
        )
        x, y = float(end[0]), float(end[1])
        figure.add("rect", x=x - 4, y=y - 4, width=8, height=8, class_="end")
        for anchor, words, at_mm in marks:
            x, y = (float(v) for v in place(at_mm))
            ring = element("circle", element("title", words), cx=x, cy=y, r=6)
            figure.add("a", ring, href=f"#{anchor}", aria_label=words, class_="ring")
        figure.label(8, size / 2 + 5, ends[0], kind="way")
        figure.label(size - 8, size / 2 + 5, ends[1], kind="way", anchor="end")
        figure.label(size / 2, 18, tops[0], kind="way", anchor="middle")
        figure.label(size / 2, size - 8, tops[1], kind="way", anchor="middle")
        scale_mm = next(mm for mm in (10, 5, 2, 1) if mm * per_mm < size / 3)
        length = scale_mm * per_mm
        figure.add("path", d=f"M12,{size - 12}h{length:.1f}", class_="axis")
        figure.label(16 + length, size - 8, f"{scale_mm} mm", kind="small")
        found.append(figure.markup())
    return found


def bars(rows: Sequence[tuple[str, float]], unit: str, title: str) -> Markup:
    """Draw named amounts as bars."""
    most = max(value for _, value in rows)
    height = 26.0 * len(rows) + 8
    told = ", ".join(f"{name} {value:.1f} {unit}" for name, value in rows)
    figure = Figure(WIDTH, height, title, f"{told}.")
    left = 260.0
    for n, (name, value) in enumerate(rows):
        y = 6 + 26.0 * n
        width = max(value / most * (WIDTH - left - 120), 1.0)
        figure.label(left - 10, y + 14, name, anchor="end")
        figure.add("rect", x=left, y=y, width=width, height=18, fill=Colour.CUT)
        figure.label(left + width + 8, y + 14, f"{value:.1f} {unit}")
    return figure.markup()
