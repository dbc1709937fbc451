"""What happens in the operating room: tools, exercises, scores. Names no renderer.

`scenarios.instruments` is imported by itself.
"""

from scenarios.clearance import Clearance, shaft_clearance
from scenarios.endoscope import Endoscope, tip_frame
from scenarios.instrument_state import InstrumentState
from scenarios.sample import Sample
from scenarios.scenario import Moment, Scenario, load_scenario
from scenarios.scoring import Score, Scorer
from scenarios.session import FrameState, Session
from scenarios.structures import Structures

__all__ = [
    "Clearance",
    "Endoscope",
    "FrameState",
    "InstrumentState",
    "Moment",
    "Sample",
    "Scenario",
    "Score",
    "Scorer",
    "Session",
    "Structures",
    "load_scenario",
    "shaft_clearance",
    "tip_frame",
]
