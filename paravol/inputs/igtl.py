"""Another program as input: tool poses by OpenIGTLink."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from devices.registration.registration_file import RegistrationRecord
from paravol.inputs.flight_input import FlightInput, framed_hand, in_the_patient
from paravol.inputs.pose_sources import OrderedPoses
from paravol.inputs.turns import ClutchTurns
from paravol.patient import PatientScene
from paravol.registration.at_start import TippedPoses, tracker_record
from scenarios import Scenario
from system import UserError


class LinkInput(FlightInput):
    """Follow a peer's tool.

    The tool's frame is that of a scope's tip: +z runs back up the shaft and y points
    to the light post. Its world is the patient's RAS frame, unless a file of `paravol
    register --input` says where it lies.
    """

    def __init__(
        self,
        host: str,
        port: int,
        tool: str | None,
        scenario: Scenario,
        registration_file: Path | None = None,
    ) -> None:
        self._record: RegistrationRecord | None = None
        self.registration = in_the_patient()
        if registration_file is not None:
            self._record = tracker_record(registration_file, tool, scenario)
            self.registration = self._record.registration()
            tool = self._record.arm_serial or None
        self._address = (host, port)
        self._tool = tool
        self.name = f"OpenIGTLink {host}:{port}"
        self.turns = ClutchTurns()
        self.completer = framed_hand(self.registration.world_from_device)

    @contextmanager
    def open(self, patient: PatientScene) -> Iterator[OrderedPoses]:
        """Connect to the peer."""
        # Imported here: only this input needs the library.
        from devices.openigtlink import OpenIGTLinkSource

        with OpenIGTLinkSource(*self._address, self._tool) as source:
            if self._record is None:
                yield source
            else:
                yield TippedPoses(source, np.array(self._record.tip_mm))


def peer_address(option: str, text: str) -> tuple[str, int, str | None]:
    """Read HOST:PORT[:TOOL]; UserError, naming the option."""
    host, _, rest = text.partition(":")
    port, _, tool = rest.partition(":")
    if not (host and port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise UserError(
            f"{option} igtl needs HOST:PORT, such as igtl:localhost:18944; "
            f"got {text!r}."
        )
    return host, int(port), tool or None
