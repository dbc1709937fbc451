"""A score as a table of names and texts.

A figure that a metric defines is told by the metric, where that was measured: a session
counts a few of them in flight by simpler rules, which are gauges and are called so.
"""

from collections.abc import Sequence

from paravol.scoring.metric_texts import metric_figure
from paravol.scoring.readings import FREE_MM, NO_LABELS
from scenarios import Score
from scenarios.hazard_watch import HazardApproach
from scenarios.metrics import Metric
from scenarios.metrics.metric import SCOPE
from scenarios.metrics.value_text import value_text
from scenarios.scoring import PRESSURE_MM, UNKNOWN_GAP_MM, OperationFigures

MOST_TISSUES = 4
"""Tissues that are named in a line."""

TOLD_MM = 10.0
"""Hazards that nothing came nearer to are left out of the table."""

_MEASURED = (
    *("task time", "path length", "contacts", "contact time", "contact share"),
    "deepest contact",
)
_MEASURED_EACH = "contact time on: ", "nearest to: "
"""Metrics that a score's table tells; of the second ones each."""


def score_rows(score: Score, metrics: Sequence[Metric] = ()) -> list[tuple[str, str]]:
    """Return the name and the text of each of a score's figures, in order.

    metrics: of the session; none where nobody has measured it yet.
    """
    measured = measured_rows(metrics)
    rows = measured or [
        ("time", f"{score.duration_s:.1f} s"),
        ("path length (gauge)", f"{score.path_length_mm:.0f} mm"),
        *contact_rows(score),
    ]
    rows.append(("smallest clearance", clearance(score)))
    rows += hazard_rows(score)
    rows += hand_rows(score)
    if score.operation is not None:
        rows += operation_rows(score.operation)
    if not measured:
        rows += [
            (f"nearest to: {name}", value_text(distance_mm, unit="mm"))
            for name, distance_mm in score.target_distance_mm.items()
        ]
    return rows


def measured_rows(metrics: Sequence[Metric]) -> list[tuple[str, str]]:
    """Return those of the scope's metrics that belong to a score's table."""
    return [
        (metric.name, metric_figure(metric))
        for metric in metrics
        if metric.role == SCOPE
        and metric.value is not None
        and (metric.name in _MEASURED or metric.name.startswith(_MEASURED_EACH))
    ]


def hand_rows(score: Score) -> list[tuple[str, str]]:
    """Return what the tool touched and how the shafts dragged on the nostril."""
    rows = []
    if score.tool is not None and score.tool.contacts:
        tool = score.tool
        deepest = f"{tool.worst_depth_mm:.2f} mm deep, {tool.worst_structure}"
        often = f"{tool.contacts}, {tool.contact_s:.1f} s in all; {deepest}"
        rows.append(("tool's contacts", often))
    for name, load in (score.nostril or {}).items():
        newtons = f"{load.mean_n:.1f} N on average, {load.most_n:.1f} N at most (guess)"
        off = f"{load.mean_mm:.1f} and {load.most_mm:.1f} mm off"
        rows.append((f"nostril: {name}", f"{newtons}; {off}"))
    return rows


def hazard_rows(score: Score) -> list[tuple[str, str]]:
    """Return how near scope and tool came to each hazard, the nearest first."""
    if score.hazards is None:
        return []
    if not score.hazards:
        return [("hazards", NO_LABELS)]
    found = sorted(score.hazards.items(), key=lambda item: item[1].nearest_mm)
    told = [item for item in found if item[1].nearest_mm < TOLD_MM]
    if not told:
        return [("hazards", f"none nearer than {TOLD_MM:g} mm")]
    return [(f"hazard: {name}", _approach(at)) for name, at in told]


def operation_rows(figures: OperationFigures) -> list[tuple[str, str]]:
    """Return what an operation took, bled, broke and hurt; nothing where it did not."""
    rows = taken_rows(figures) if figures.edits else []
    if figures.washes:
        touched = f"it touched tissue for {figures.lens_touched_s:.1f} s"
        rows.append(("lens washed", f"{figures.washes:d} x; {touched}"))
    if figures.injected_ml:
        rows.append(("injected", f"{figures.injected_ml:.2f} mL"))
    if figures.greatest_n or figures.scope_n:
        pressed = f"tool {figures.greatest_n:.1f} N, scope {figures.scope_n:.1f} N"
        rows.append(("greatest force", pressed))
    if figures.breaks:
        rows += [("broken", f"{each}, {each.time_s:.1f} s") for each in figures.breaks]
    elif figures.broken_walls:
        broken = [f"{name} {n:d} x" for name, n in sorted(figures.broken_walls.items())]
        rows.append(("broken", ", ".join(broken)))
    if figures.edits and not figures.injuries:
        rows.append(("injuries", "none"))
    return rows + [
        (
            f"injury: {injury.structure}",
            f"{injury.depth_mm:.1f} mm deep at {injury.time_s:.1f} s, {injury.side}, "
            f"{f'through the {injury.wall}' if injury.wall else 'no bone there'}, "
            f"by the {injury.by}",
        )
        for injury in figures.injuries
    ]


def taken_rows(figures: OperationFigures) -> list[tuple[str, str]]:
    """Return what an operation took, and how it bled."""
    taken = sorted(figures.removed_mm3.items(), key=lambda item: -item[1])
    most = ", ".join(f"{name} {mm3:.0f}" for name, mm3 in taken[:MOST_TISSUES])
    whole = f"{sum(figures.removed_mm3.values()):.0f} mm3"
    return [
        ("tissue removed", f"{whole}: {most}" if most else whole),
        ("blood", f"{figures.bled_ml:.1f} mL, {figures.sucked_ml:.1f} mL sucked off"),
    ]


def _approach(at: HazardApproach) -> str:
    text = f"scope {at.shaft_mm:.1f} mm at {at.shaft_s:.1f} s"
    if at.instrument_mm is not None:
        text += f"; tool {at.instrument_mm:.1f} mm at {at.instrument_s:.1f} s"
    return text


def clearance(score: Score) -> str:
    """Return the smallest gap; none is known without a sample."""
    gap_mm = score.min_clearance_mm
    if gap_mm > FREE_MM:
        return "unknown" if gap_mm >= UNKNOWN_GAP_MM else "free"
    return f"{gap_mm:.2f} mm"


def contact_rows(score: Score) -> list[tuple[str, str]]:
    """Return how often, how long, how deep and what was touched."""
    if not score.contacts:
        return [("contacts (gauge)", "none")]
    share = score.contact_s / score.duration_s if score.duration_s > 0.0 else 0.0
    # By time; of equal times the one touched first.
    touched = sorted(score.touched_s.items(), key=lambda item: -item[1])
    return [
        (
            "contacts (gauge)",
            f"{score.contacts}, {score.contact_s:.1f} s in all ({share:.0%})",
        ),
        (f"pressed deeper than {PRESSURE_MM:g} mm", f"{score.pressure_s:.1f} s"),
        (
            "deepest contact (gauge)",
            f"{score.worst_depth_mm:.2f} mm, {score.worst_structure}",
        ),
        (
            "touched (gauge)",
            "; ".join(f"{name} {time_s:.1f} s" for name, time_s in touched),
        ),
    ]
