"""The surgeon's tools: what they do, their shapes as meshes, capsules and solids."""

from scenarios.instruments.catalogue import (
    INSTRUMENTS,
    Action,
    Instrument,
    instrument_named,
    placed_tool,
)
from scenarios.instruments.parts import MARGIN_MM, Capsules
from scenarios.instruments.suction import suction_tube

__all__ = [
    "INSTRUMENTS",
    "MARGIN_MM",
    "Action",
    "Capsules",
    "Instrument",
    "instrument_named",
    "placed_tool",
    "suction_tube",
]
