"""Where a window's flight is recorded: by name, unasked, or nowhere."""

import shutil
import tempfile
from contextlib import ExitStack
from pathlib import Path

import msgspec

from paravol.flight_end import FlightEnd
from paravol.flight_order import FlightOrder
from scenarios import Score
from scenarios.bundle import SessionInfo, SessionRecorder


class FlightRecording:
    """Open the recording of a flight and remember where it is.

    folder: None where none is kept. problem: why, one sentence.
    """

    def __init__(self, order: FlightOrder) -> None:
        self._order = order
        self.folder: Path | None = None
        self.problem = ""

    def open(self, stack: ExitStack, info: SessionInfo) -> SessionRecorder:
        """Begin to record; the stack closes it.

        A flight that nobody named a folder for goes on where it cannot be kept.
        """
        order = self._order
        if order.record is not None:
            recorder = stack.enter_context(SessionRecorder(order.record, info))
            self.folder = order.record
            return recorder
        if order.kept is not None:
            unasked = msgspec.structs.replace(info, automatic=True)
            place: Path | None = None
            try:
                held = order.kept.new_session(order.scenario.name)
                place = stack.enter_context(held)
                recorder = stack.enter_context(SessionRecorder(place, unasked))
            except OSError as error:
                self.problem = f"{order.kept.folder} cannot be written ({error})."
                if place is not None:
                    shutil.rmtree(place, ignore_errors=True)
            else:
                self.folder = place
                return recorder
        scratch = tempfile.TemporaryDirectory(prefix="paravol-train-")
        folder = Path(stack.enter_context(scratch))
        return stack.enter_context(SessionRecorder(folder, info))

    def end(self, title: str, score: Score) -> FlightEnd:
        """Say how the flight ended."""
        automatic = self._order.record is None
        return FlightEnd(title, score, self.folder, automatic, self.problem)
