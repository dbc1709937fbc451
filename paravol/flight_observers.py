"""Several who hear of one flight: the window that shows it, and who looks on."""

from devices import DeviceError
from paravol.flight import FlightEnd, FlightObserver
from paravol.flight_loop import FrameEvent
from paravol.patient import PatientScene
from scenarios.tasks import TaskEvent


class FlightObservers(FlightObserver):
    """Pass everything on to several observers, in their order."""

    def __init__(self, *observers: FlightObserver) -> None:
        self._observers = observers

    def on_progress(self, stage: str, share: float) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_progress(stage, share)

    def on_patient(self, patient: PatientScene) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_patient(patient)

    def on_touch(self, stage: str, share: float) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_touch(stage, share)

    def on_start(self, residual_mm: float | None) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_start(residual_mm)

    def on_frame(self, event: FrameEvent) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_frame(event)

    def keeps_tissue(self, time_s: float) -> bool:
        """Return whether anybody wants the tissue."""
        return any([observer.keeps_tissue(time_s) for observer in self._observers])

    def on_moment(self, event: FrameEvent) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_moment(event)

    def on_view_saved(self, message: str, where: str) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_view_saved(message, where)

    def on_injury(self, text: str) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_injury(text)

    def on_task(self, event: TaskEvent) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_task(event)

    def on_loss(self, loss: DeviceError) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_loss(loss)

    def on_return(self, away_s: float) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_return(away_s)

    def on_late(self, text: str) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_late(text)

    def on_tool_device(self, text: str) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_tool_device(text)

    def on_unrecorded(self, problem: str) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_unrecorded(problem)

    def on_end(self, result: FlightEnd | None) -> None:
        """Pass it on."""
        for observer in self._observers:
            observer.on_end(result)
