"""Views of a flight, saved as files while it goes on."""

from pathlib import Path

from paravol.patient import OperatingRoom
from paravol.session_info import SEED
from paravol.snapshots.view_file import save_view
from paravol.snapshots.view_sources import view_of
from paravol.view import Frame
from scenarios import Sample, Scenario, View


class ViewKeeper:
    """Write the view of a frame, with its gain, for `paravol snapshot --view`."""

    def __init__(
        self,
        scenario: Scenario,
        room: OperatingRoom,
        record: Path | None,
        *,
        has_instrument: bool,
    ) -> None:
        """Take a flight; record: its recording, None to write into this folder."""
        self._scenario = scenario
        self._room = room
        self._folder = Path() if record is None else record / "snapshots"
        self._has_instrument = has_instrument

    def keep(
        self, view: View, frame: Frame, sample: Sample, number: int
    ) -> tuple[str, str]:
        """Write a view file; say so, and where it is, or why there is none.

        A disk that refuses ends no flight.
        """
        file = self._folder / f"view-{sample.time_s:.2f}.view.json"
        found = view_of(
            view,
            self._scenario,
            self._room,
            gain=frame.gain,
            number=number,
            seed=SEED,
            has_instrument=self._has_instrument,
        )
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            save_view(file, found)
        except OSError as error:
            return "The view was not saved", str(error)
        return f"Saved the view at {sample.time_s:.1f} s", str(file)
