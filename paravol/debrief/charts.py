"""The page's figures: timeline, hazards over time, the path in three planes.

Where things lie is worked out here; templates/figures.svg draws them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from paravol.debrief.colours import HAZARD_LINES, TEMPLATES, Colour, templates
from paravol.debrief.events import Event, Kind
from paravol.debrief.findings import Findings

WIDTH, LEFT, RIGHT = 960, 118, 14

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

GRAVE = Kind.INJURY, Kind.BREAK

AXES = ("right to left", "front to back", "down to up")
PLANES = (
    ("From the front", 0, 2, "RLSI"),
    ("From the right", 1, 2, "APSI"),
    ("From below", 0, 1, "RLAP"),
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

    def ticks(self) -> list[tuple[float, str]]:
        """Return the places of eight or so round times, and their words."""
        rough = max((self.end_s - self.begin_s) / 8, 1e-3)
        power = 10.0 ** math.floor(math.log10(rough))
        step = next(s * power for s in (1, 2, 5, 10) if s * power >= rough)
        first = math.ceil(self.begin_s / step)
        last = int(self.end_s / step + 1e-9)
        times = [n * step for n in range(first, last + 1)]
        return [(self(time_s), f"{time_s:g} s") for time_s in times]


@cache
def _figures() -> Any:
    """Return the template's macros."""
    environment = templates(TEMPLATES)
    environment.globals |= {
        "width": WIDTH,
        "left": LEFT,
        "right": WIDTH - RIGHT,
        "lane_colours": LANE_COLOURS,
        "moments": MOMENTS,
        "grave": GRAVE,
    }
    return environment.get_template("figures.svg").module


def timeline(findings: Findings, events: Sequence[Event]) -> Markup:
    """Draw a lane for each kind of event, with links to their entries, and blood."""
    scale = _Scale(findings.begin_s, findings.end_s)
    lanes = [kind for kind in Kind if any(e.kind is kind for e in events)]
    blood = findings.followed.blood
    most_ml = blood[-1][1] if blood else 0.0
    told = ", ".join(f"{kind} {sum(e.kind is kind for e in events)}" for kind in lanes)
    length_s = findings.end_s - findings.begin_s
    return Markup(
        _figures().timeline(
            f"{length_s:.0f} seconds; {told or 'no events'}.",
            scale.ticks(),
            [
                (
                    str(kind),
                    [
                        (e, scale(e.begin_s), scale(e.end_s))
                        for e in events
                        if e.kind is kind
                    ],
                )
                for kind in lanes
            ],
            [(scale(t), ml / most_ml) for t, ml in blood] if most_ml > 0.0 else [],
            most_ml,
        )
    )


def hazards(
    findings: Findings, gaps: Mapping[str, NDArray[np.float64]], margin_mm: float
) -> Markup:
    """Draw how near scope or tool was to the nearest hazards, over time.

    gaps: mm by hazard, at the session's samples. The scale is that of the square root:
    near is drawn larger than far, and all beyond `CLIPPED_MM` alike.
    """
    scale = _Scale(findings.begin_s, findings.end_s)
    top, bottom = 10, 250
    nearest = ", ".join(f"{name} {np.nanmin(mm):.1f} mm" for name, mm in gaps.items())
    low = min(0.0, *(float(np.nanmin(mm)) for mm in gaps.values()))
    low = math.floor(max(low, -10.0))

    def at(mm: float) -> float:
        held = min(max(mm, low), CLIPPED_MM)
        root = math.sqrt((held - low) / (CLIPPED_MM - low))
        return bottom - root * (bottom - top)

    levels = []
    for level in sorted({low, 0.0, 1.0, margin_mm, 5.0, 10.0, CLIPPED_MM}):
        word = f"{level:g} mm" + (" +" if level == CLIPPED_MM else "")
        word = f"margin {level:g}" if level == margin_mm else word
        levels.append((at(level), word))
    times = np.array(findings.followed.time_s)
    lines = [
        {
            "colour": str(HAZARD_LINES[n % len(HAZARD_LINES)]),
            "dash": DASHES[n % len(DASHES)],
            "pieces": [
                [(scale(t), at(d)) for t, d in points] for points in _lines(times, mm)
            ],
            "words": f"{name}: {np.nanmin(mm):.1f} mm at least",
        }
        for n, (name, mm) in enumerate(gaps.items())
    ]
    return Markup(
        _figures().hazards(
            f"Nearest: {nearest}.",
            scale.ticks(),
            top,
            bottom,
            (at(margin_mm), at(low)),
            levels,
            lines,
        )
    )


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
    size, edge = 320, 18
    per_mm = (size - 2 * edge) / side_mm
    found = []
    for title, across, up, letters in PLANES:
        sign = -1.0 if up == 2 else 1.0

        def place(
            points: NDArray[np.float64], a: int = across, b: int = up, s: float = sign
        ) -> NDArray[np.float64]:
            x = size / 2 + (points[..., a] - middle[a]) * per_mm
            y = size / 2 + s * (points[..., b] - middle[b]) * per_mm
            return np.stack([x, y], axis=-1)

        scale_mm = next(mm for mm in (10, 5, 2, 1) if mm * per_mm < size / 3)
        drawn = _figures().plane(
            size,
            title,
            f"The scope's way, {AXES[across]} {high[across] - low[across]:.0f} mm and "
            f"{AXES[up]} {high[up] - low[up]:.0f} mm.",
            [place(piece).tolist() for piece in own],
            [place(piece).tolist() for piece in other],
            [(anchor, words, place(mm).tolist()) for anchor, words, mm in marks],
            letters,
            scale_mm,
            scale_mm * per_mm,
        )
        found.append(Markup(drawn))
    return found


def bars(rows: Sequence[tuple[str, float]], unit: str, title: str) -> Markup:
    """Draw named amounts as bars."""
    told = ", ".join(f"{name} {value:.1f} {unit}" for name, value in rows)
    most = max(value for _, value in rows)
    return Markup(_figures().bars(title, f"{told}.", rows, most, unit))


def head(
    size: tuple[int, int],
    url: str,
    pieces: Sequence[tuple[NDArray[np.float64], bool]],
) -> Markup:
    """Draw the ways over a picture of the opened head.

    pieces: pixels ``(n, 2)`` and whether tissue hides them.
    """
    told = [(points.tolist(), is_hidden) for points, is_hidden in pieces]
    return Markup(_figures().head(size, url, told))
