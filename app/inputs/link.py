"""Another program as input: tool poses by OpenIGTLink."""

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from app.inputs.flight_input import FlightInput, framed_hand, in_the_patient
from app.operating_room import OperatingRoom

if TYPE_CHECKING:
    from devices.openigtlink import OpenIGTLinkSource


class LinkInput(FlightInput):
    """Follow a peer's tool, whose world is the patient's RAS frame.

    The tool's frame is that of a scope's tip: +z runs back up the shaft and y points
    to the light post.
    """

    def __init__(self, host: str, port: int, tool: str | None) -> None:
        self._address = (host, port)
        self._tool = tool
        self.name = f"OpenIGTLink {host}:{port}"
        self.keys = {"← →": "turn the light post"}
        self.aim = framed_hand()
        self.registration = in_the_patient()

    def open(self, room: OperatingRoom) -> AbstractContextManager["OpenIGTLinkSource"]:
        """Connect to the peer."""
        # Its library is loaded only by whoever flies with it.
        from devices.openigtlink import OpenIGTLinkSource

        return OpenIGTLinkSource(*self._address, self._tool)
