"""What a recorded session measures: pure functions of samples, edits and injuries.

`registry` names every metric; docs/metrics.md has their formulas, units and sources.
"""

from scenarios.metrics.measured import (
    Breach,
    Contacts,
    HazardGaps,
    Measured,
    Reference,
    Taken,
)
from scenarios.metrics.metric import Definition, Metric
from scenarios.metrics.recorded import (
    scope_changes,
    scope_track,
    tool_track,
    tool_use,
)
from scenarios.metrics.registry import DEFINITIONS, definitions_named, measure
from scenarios.metrics.settings import Settings, load_settings
from scenarios.metrics.track import Track
from scenarios.metrics.uncertainty import PoseNoise, SessionNoise, recorded_noise

__all__ = [
    "DEFINITIONS",
    "Breach",
    "Contacts",
    "Definition",
    "HazardGaps",
    "Measured",
    "Metric",
    "PoseNoise",
    "Reference",
    "SessionNoise",
    "Settings",
    "Taken",
    "Track",
    "definitions_named",
    "load_settings",
    "measure",
    "recorded_noise",
    "scope_changes",
    "scope_track",
    "tool_track",
    "tool_use",
]
