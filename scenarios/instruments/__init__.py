"""The surgeon's tools: what they do, their shapes as meshes, capsules and solids."""

from scenarios.instruments.catalogue import (
    INSTRUMENTS,
    SUCTION_TUBE,
    Action,
    Instrument,
    instrument_named,
)
from scenarios.instruments.parts import MARGIN_MM, Capsules
from scenarios.instruments.suction import suction_tube

__all__ = [
    "INSTRUMENTS",
    "MARGIN_MM",
    "SUCTION_TUBE",
    "Action",
    "Capsules",
    "Instrument",
    "instrument_named",
    "suction_tube",
]
