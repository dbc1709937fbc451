"""A replay that a window watches."""

import threading
from dataclasses import replace

# beside the home page already: no flight waits for what draws heads
from app.vtk.head_model import session_head
from app.window.ending import begin_ending
from app.window.session_thread import (
    FrameReady,
    HeadModelled,
    SessionThread,
    SlicesReady,
)
from paravol.flight.flight_events import HeadLoaded, Progressed
from paravol.sessions.replay_events import (
    Measuring,
    Near,
    ReplayEvent,
    ReplayOrder,
    Seeking,
    ShownReplay,
)
from paravol.sessions.replay_worker import ReplayWorker

ReplayWindowEvent = ReplayEvent | FrameReady | SlicesReady | HeadModelled
"""What a window hears of a replay; never `ShownReplay` or `HeadLoaded` themselves."""


class ReplayThread(SessionThread[ShownReplay]):
    """Replay one session, or two side by side, and report to a window."""

    def __init__(self, order: ReplayOrder) -> None:
        """Prepare a replay; `worker.start` begins it."""
        super().__init__()
        self.worker = ReplayWorker(order, self.hear)

    def leave(self) -> threading.Thread:
        """End what goes on; see `begin_ending`."""
        return begin_ending(self, self.worker.stop)

    def hear(self, event: ReplayEvent) -> None:
        """Tell the window; build what it shows of the head."""
        match event:
            case ShownReplay():
                self._keep(event)
            case Progressed() | Seeking() | Measuring():
                self._tell_news(replace(event, share=round(event.share, 2)))
            case Near():
                self._tell_news(event)
            case HeadLoaded(patient):
                self.told.emit(SlicesReady(patient.slice_views()))
                cut_open, scenario = self.worker.cutter(), self.worker.scenario
                model = session_head(patient, scenario, cut_open)
                self.told.emit(HeadModelled(model))
            case _:
                self.told.emit(event)
