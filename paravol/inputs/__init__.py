"""What may play the endoscope: an arm, a hand, a recording, another program."""

from paravol.inputs.flight_input import FlightInput
from paravol.inputs.input_choice import choose_input

__all__ = ["FlightInput", "choose_input"]
