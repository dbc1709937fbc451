"""The page: what its parts say, filled into the template beside this module."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from paravol.debrief import charts
from paravol.debrief.advice import advice, amount
from paravol.debrief.colours import TEMPLATES, templates
from paravol.debrief.events import Event, Kind
from paravol.debrief.findings import Findings
from paravol.debrief.pictures import Picture, Pictures, Quality
from paravol.scoring.metric_texts import metric_figure
from paravol.scoring.score_table import score_rows
from paravol.scoring.verdict_texts import headline_text, points_text, verdict_text
from scenarios.hazard_watch import ALWAYS_NEAR
from scenarios.metrics import Track
from scenarios.metrics.value_text import value_text
from scenarios.passing import goals_of
from scenarios.rubrics import Assessment

QUALITIES = {
    None: "No pictures were drawn.",
    Quality.FAST: "Pictures are those of the live renderer, drawn again.",
    Quality.FINE: "Pictures are drawn by the ray tracer, finer than they were live.",
}

LEAST_MM3 = 0.05
"""Tissues of which less was taken are left out of the figure."""


@dataclass(frozen=True, slots=True)
class PageContext:
    """What the page is made of.

    head: the opened head with the way, "" without. assessment: by a rubric. seen: the
    mucosa, coloured by for how long it was in sight; None without a picture.
    """

    findings: Findings
    events: Sequence[Event]
    pictures: Pictures
    head: Markup
    assessment: Assessment
    seen: Picture | None = None


def page(material: PageContext) -> str:
    """Return the whole HTML file; the same material gives the same text."""
    environment = templates(TEMPLATES)
    # ours, with nothing from any file in them
    style = Markup(environment.get_template("page.css").render())
    return environment.get_template("page.html").render(
        style=style,
        script=Markup((TEMPLATES / "page.js").read_text("utf-8")),
        **_told(material),
    )


def _told(material: PageContext) -> dict[str, Any]:
    findings, events = material.findings, material.events
    score = findings.score
    measured = findings.metrics.measured
    gaps = nearest_gaps(findings)
    pieces = tip_pieces(measured.scope)
    other = [] if findings.compared is None else tip_pieces(findings.compared.track)
    return {
        "material": material,
        "findings": findings,
        "head_words": _head_words(findings),
        "figures": score_rows(score, findings.metrics.metrics),
        "amount": amount,
        "points_text": points_text,
        "headline": headline_text(material.assessment)
        if material.assessment.exercise is not None
        else verdict_text(material.assessment),
        "titles": {task.name: task.title for task in findings.scenario.tasks},
        "goals": goals_of(findings.scenario),
        "timeline": charts.timeline(findings, events),
        "told": [event for event in events if event.is_told],
        "untold": sum(not event.is_told for event in events),
        "picture_words": QUALITIES[material.pictures.quality],
        "hazard_chart": charts.hazards(findings, gaps, measured.settings.margin_mm)
        if gaps
        else "",
        "hazards": sorted(
            (score.hazards or {}).items(), key=lambda item: item[1].nearest_mm
        ),
        "always_near": ALWAYS_NEAR,
        "margin_of": findings.metrics.settings.margin_of,
        "far_mm": charts.CLIPPED_MM,
        "paths": charts.paths(pieces, other, _marks(findings, events))
        if pieces
        else [],
        "has_other": bool(other),
        "removed": _removed(findings),
        "bands": _bands(material.assessment),
        "figure": metric_figure,
        "value_text": value_text,
        "advice": advice(findings, events, material.assessment),
    }


def nearest_gaps(findings: Findings) -> dict[str, NDArray[np.float64]]:
    """Return how near scope or tool was to each hazard, the nearest hazards first."""
    measured = findings.metrics.measured
    found: dict[str, NDArray[np.float64]] = {}
    for gaps in (measured.hazards, measured.tool_hazards):
        for name, mm in {} if gaps is None else gaps.gap_mm.items():
            found[name] = np.fmin(found[name], mm) if name in found else mm
    known = {name: mm for name, mm in found.items() if np.isfinite(mm).any()}
    order = sorted(known, key=lambda name: float(np.nanmin(known[name])))
    return {name: known[name] for name in order[: charts.MOST_HAZARDS]}


def _head_words(findings: Findings) -> str:
    head, scope = findings.scenario.head, findings.scenario.scope
    changes = findings.metrics.measured.scope_changes
    angles = dict.fromkeys((scope.angle_deg, *(angle for _, angle in changes)))
    told = ", ".join(f"{angle:g}°" for angle in angles)
    return f"{head.words()}; scope {told}, {scope.diameter_mm:g} mm"


def _removed(findings: Findings) -> dict[str, Any] | None:
    """Return what was taken; None where nobody operated."""
    operation = findings.score.operation
    if operation is None:
        return None
    tissues = _largest(operation.removed_mm3)
    walls = _largest(operation.wall_bone_mm3)
    return {
        "whole_mm3": sum(operation.removed_mm3.values()),
        "tissues": charts.bars(tissues, "mm3", "Tissue taken") if tissues else "",
        "walls": charts.bars(walls, "mm3", "Bone of walls taken") if walls else "",
        "operation": operation,
    }


def _largest(amounts: dict[str, float]) -> list[tuple[str, float]]:
    found = sorted(amounts.items(), key=lambda item: (-item[1], item[0]))
    return [item for item in found if item[1] >= LEAST_MM3]


def tip_pieces(track: Track) -> list[NDArray[np.float64]]:
    """Return the tip's places, in pieces between which it was away."""
    found = [track.tip_mm[places] for places in track.spans(0.5)]
    most = max(sum(map(len, found)) // 1500, 1)
    return [np.concatenate([p[:-1:most], p[-1:]]) for p in found if len(p) > 1]


def _marks(
    findings: Findings, events: Sequence[Event]
) -> list[tuple[str, str, NDArray[np.float64]]]:
    """Return injuries and approaches with where the scope's tip was."""
    track = findings.metrics.measured.scope
    return [
        (
            event.anchor,
            f"{event.shown_s:.1f} s: {event.title}",
            track.tip_mm[int(np.abs(track.time_s - event.shown_s).argmin())],
        )
        for event in events
        if event.is_told and event.kind in (Kind.INJURY, Kind.BREAK, Kind.HAZARD)
    ]


def _bands(assessment: Assessment) -> dict[tuple[str, str], str]:
    """Return where groups of the reference population lie, by role and metric."""
    return {
        (part.role, part.source): "; ".join(
            f"{band.group} {value_text(band.low)} to {value_text(band.high)}"
            for band in part.bands
        )
        for part in assessment.parts
        if part.bands
    }
