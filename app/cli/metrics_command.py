"""`paravol metrics`: compute, print, write tables."""

from dataclasses import asdict, dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
from cyclopts import Parameter

from app.cli.root import Flag, Json
from app.cli.terminal import ProgressReporter, print_json, print_table
from system import require_place, whole_file
from system.csv_table import CsvTable

if TYPE_CHECKING:
    from paravol.scoring.session_metrics import SessionMetrics
    from scenarios.metrics import Metric

COLUMNS = "MetricName", "MetricRoles", "MetricUnit", "MetricValue"
"""Of PerkTutor's table of metrics; ours come behind them."""

OUR_COLUMNS = "Sigma", "NoiseFloor", "Remark"


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class MetricsOptions:
    """Options of metrics, as they were typed.

    Parameters
    ----------
    csv
        Write a table that begins with PerkTutor's columns.
    json_file
        Write all values, with the seconds of the session that each came from.
    only
        Compute the metrics of this name; may be given several times.
    settings
        TOML file of thresholds and filters, and of what was to be removed.
    arm
        Profile of the arm that was used, such as dx: noise from its counts. Without
        it the noise is estimated from the record.
    case
        Where the case that was flown through lies now.
    expert
        Another session of the same head, whose path, and the cavity it cut, are
        compared with.
    motion_only
        Leave the head out: no contact, hazards, targets or removal, but at once.
    """

    csv: Path | None = None
    json_file: Path | None = None
    only: tuple[str, ...] = ()
    settings: Path | None = None
    arm: str = ""
    case: Path | None = None
    expert: Path | None = None
    motion_only: Flag = False


def metrics(
    session: Path, *, options: MetricsOptions = MetricsOptions(), json: Json = False
) -> int:
    """Measure how a recorded session was flown: path, smoothness, view, contact.

    Every value comes with the share of the device's noise in it, 1 sigma.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    """
    from paravol.scoring.session_metrics import session_metrics
    from scenarios.bundle import write_json
    from scenarios.metrics import (
        DEFINITIONS,
        Settings,
        definitions_named,
        load_settings,
    )

    for file in (options.csv, options.json_file):
        if file is not None:
            require_place(file)
    settings = Settings()
    if options.settings is not None:
        settings = load_settings(options.settings)
    chosen = DEFINITIONS
    if options.only:
        chosen = definitions_named(options.only)
    with ProgressReporter() as stages:
        found = session_metrics(
            session,
            settings=settings,
            chosen=chosen,
            arm=options.arm,
            case=options.case,
            has_head=not options.motion_only,
            expert=options.expert,
            progress=stages,
        )
    if options.csv is not None:
        with whole_file(options.csv) as beside:
            beside.write_text(as_csv(found.metrics), "utf-8")
    if options.json_file is not None:
        write_json(options.json_file, _report(session, found))
    if json:
        print_json(_report(session, found))
    else:
        _print(session, found)
    return 0


def as_csv(metrics: "list[Metric]") -> str:
    """Return PerkTutor's columns, then ours; a missing value is an empty cell."""
    from paravol.scoring.metric_texts import metric_remark

    text = StringIO()
    table = CsvTable(text)
    table.add([*COLUMNS, *OUR_COLUMNS])
    for metric in metrics:
        figures = (metric.value, metric.sigma, metric.floor)
        value, sigma, floor = ("" if f is None else repr(f) for f in figures)
        row = [metric.name, metric.role, metric.unit, value, sigma, floor]
        table.add([*row, metric_remark(metric)])
    return text.getvalue()


def _report(session: Path, found: "SessionMetrics") -> dict[str, object]:
    return {
        "session": session.name,
        "is_complete": found.is_complete,
        "noise": {
            role: {
                "tip_mm": noise.axis_mm,
                "turn_rad": noise.turn_rad,
                "offset_mm": noise.offset_mm,
                "source": noise.source,
            }
            for role, noise in (
                ("scope", found.noise.scope),
                ("tool", found.noise.tool),
            )
        },
        "settings": msgspec.to_builtins(found.settings),
        "metrics": [
            {**asdict(metric), "is_noise": metric.is_noise} for metric in found.metrics
        ],
    }


def _print(session: Path, found: "SessionMetrics") -> None:
    from paravol.scoring.metric_texts import metric_text, says_nothing

    scope, tool = found.noise.scope, found.noise.tool
    rows = [
        (
            "noise of an axis",
            f"scope {scope.axis_mm:.3f} mm (from {scope.source}), registration "
            f"{scope.offset_mm:.3f} mm; tool {tool.axis_mm:.3f} mm",
        )
    ]
    if not found.is_complete:
        rows.append(("recording", "ends in the middle"))
    told = [metric for metric in found.metrics if not says_nothing(metric)]
    rows += [(f"{m.role}: {m.name}", metric_text(m)) for m in told]
    left_out = len(found.metrics) - len(told)
    if left_out:
        rows.append(("left out", f"{left_out} that are 0 or far away; --json has them"))
    print_table(f"Metrics of {session}", rows)
