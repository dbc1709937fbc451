"""What may play the endoscope: an arm, a hand, a recording, another program."""

from app.inputs.choice import choose_input
from app.inputs.flight_input import FlightInput

__all__ = ["FlightInput", "choose_input"]
