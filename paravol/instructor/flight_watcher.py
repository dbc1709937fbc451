"""The newest of a flight, kept for whoever looks on: nothing queues, nothing grows."""

import io
import math
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from paravol.flight import flight_events as events
from paravol.flight.flight_events import FlightEnd
from paravol.flight.flight_loop import FrameEvent
from paravol.patient import PatientScene
from paravol.scoring.readings import HAZARD_FAR_MM, NEAR_MM, tool_text
from paravol.slices.side_letters import looks_towards, side_letters
from scenarios import Scenario
from scenarios.hazard_watch import ALWAYS_NEAR, hazard_gaps
from scenarios.instrument_state import NO_TOOL
from scenarios.session import SHAFT_CHECKED_MM
from scenarios.tasks import TaskState

MOST_INJURIES = 50
"""The newest that are told; all are counted."""

LARGEST_PIXELS = 512
"""Of the picture that is sent; larger ones are made smaller."""

JPEG_QUALITY = 82


class FlightWatcher:
    """Hear of a flight; give its newest picture and state to any number of threads.

    The thread that flies leaves a reference here and goes on. Pictures are encoded and
    distances measured by who asks for them, once for all who do.
    """

    def __init__(
        self,
        scenario: Scenario,
        begun: "Callable[[FlightWatcher], object] | None" = None,
    ) -> None:
        """Prepare to hear of a flight; begun: called once, when there is one."""
        self.scenario = scenario
        self._begun = begun
        self._changed = threading.Condition()
        self._version = 0
        self._event: FrameEvent | None = None
        self._patient: PatientScene | None = None
        self._stage = "Preparing"
        self._device = "there"
        self._tool_device = ""
        self._residual_mm: float | None = None
        self._injuries: deque[dict[str, Any]] = deque(maxlen=MOST_INJURIES)
        self._injury_count = 0
        self._result: FlightEnd | None = None
        self._is_over = False
        self._encoding = threading.Lock()
        self._picture: tuple[FrameEvent, bytes] | None = None
        self._measuring = threading.Lock()
        self._gaps: tuple[FrameEvent, list[dict[str, Any]]] | None = None

    def hear(self, event: events.FlightEvent) -> None:
        """Keep what is newest."""
        match event:
            case events.Progressed(stage, share):
                self._tell_stage(stage, share)
            case events.Touching(_, share):
                self._tell_stage("Registering", share)
            case events.HeadLoaded(patient):
                self._tell(_patient=patient)
            case events.RecordingBegan(residual_mm):
                self._tell(_stage="Flying", _residual_mm=residual_mm)
            case FrameEvent():
                self._tell(_event=event)
            case events.Injured(text):
                self._keep_injury(text)
            case events.DeviceLost(loss):
                self._tell(_device=f"away: {loss}")
            case events.DeviceBack(away_s):
                self._tell(_device=f"there again after {away_s:.1f} s")
            case events.StoodStill(text):
                self._tell(_device=text)
            case events.ToolDeviceNews(text):
                self._tell(_tool_device=text)
            case events.FlightOver(result):
                self._tell(_result=result, _is_over=True, _stage="The flight is over")

    def _tell_stage(self, stage: str, share: float) -> None:
        text = f"{stage}: {round(100 * share)} %"
        if text != self._stage:
            self._tell(_stage=text)

    def _keep_injury(self, text: str) -> None:
        """Keep it with the score's clock."""
        with self._changed:
            clock_s = 0.0 if self._event is None else self._event.clock_s
            self._injury_count += 1
            told = {"number": self._injury_count, "clock_s": clock_s, "text": text}
            self._injuries.append(told)
        self._tell()

    def wait(self, after: int, timeout_s: float) -> int:
        """Wait until something is newer than the version `after`; return the newest.

        Returns at the end of the time, too.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._version > after, timeout_s)
            return self._version

    def wake(self) -> None:
        """Let all who wait look again."""
        with self._changed:
            self._changed.notify_all()

    def picture(self) -> bytes | None:
        """Return the newest frame as JPEG; None before the first."""
        from PIL import Image

        with self._encoding:
            event = self._event
            if event is None:
                return None
            if self._picture is None or self._picture[0] is not event:
                image = Image.fromarray(event.frame.pixels)
                image.thumbnail((LARGEST_PIXELS, LARGEST_PIXELS))
                sink = io.BytesIO()
                image.save(sink, "JPEG", quality=JPEG_QUALITY)
                self._picture = event, sink.getvalue()
            return self._picture[1]

    def state(self) -> dict[str, Any]:
        """Return all that is told beside the picture, for JSON."""
        with self._changed:
            event, result = self._event, self._result
            told: dict[str, Any] = {
                "title": self.scenario.title,
                "stage": self._stage,
                "device": self._device,
                "tool_device": self._tool_device,
                "residual_mm": self._residual_mm,
                "injuries": list(self._injuries),
                "injury_count": self._injury_count,
                "is_over": self._is_over,
            }
        told["result"] = [] if result is None else result.rows()
        if event is None:
            return told
        view, sample = event.view, event.sample
        _, right, up, forward = view.camera.frame
        changed_deg = sample.scope_deg
        angle_deg = (
            self.scenario.scope.angle_deg if changed_deg is None else changed_deg
        )
        told |= {
            "letters": [asdict(each) for each in side_letters(right, up)],
            "looks": looks_towards(forward),
            "clock_s": event.clock_s,
            "is_frozen": sample.is_frozen,
            "scope": f"{angle_deg:g}\N{DEGREE SIGN}",
            "clearance_mm": _finite(view.clearance_mm),
            "touched": view.touched,
            "tool": tool_text(sample.instrument),
            "cuts": event.cuts,
            "pose_age_ms": event.pose_age_ms,
            "near_mm": NEAR_MM,
            "tasks": [self._task(state) for state in event.tasks],
            "hazards": self._hazards(event),
        }
        return told

    def _tell(self, **news: object) -> None:
        begun, self._begun = self._begun, None
        if begun is not None:
            begun(self)
        with self._changed:
            for name, value in news.items():
                setattr(self, name, value)
            self._version += 1
            self._changed.notify_all()

    def _task(self, state: TaskState) -> dict[str, Any]:
        titles = {task.name: task.title for task in self.scenario.tasks}
        return {
            "title": titles.get(state.name, state.name),
            "status": state.status.value,
            "progress": state.progress,
            "why": state.why,
        }

    def _hazards(self, event: FrameEvent) -> list[dict[str, Any]] | None:
        """Return the distances from scope or tool, nearest first; None where unknown.

        What lies farther than anybody cares about is left out.
        """
        patient = self._patient
        if patient is None or patient.hazards is None:
            return None
        with self._measuring:
            if self._gaps is None or self._gaps[0] is not event:
                tool_mm = None
                if event.sample.instrument.name != NO_TOOL:
                    tool_mm = event.view.world_from_instrument[:3, 3]
                radius_mm = self.scenario.scope.diameter_mm / 2
                pose = event.view.world_from_tip
                gaps = hazard_gaps(
                    patient.hazards, pose, radius_mm, SHAFT_CHECKED_MM, tool_mm
                ).nearest_mm()
                found = [
                    {"name": name, "mm": mm}
                    for name, mm in sorted(gaps.items(), key=lambda gap: gap[1])
                    if mm < HAZARD_FAR_MM and name not in ALWAYS_NEAR
                ]
                self._gaps = event, found
            return self._gaps[1]


def _finite(value: float) -> float | None:
    """Return a figure that JSON knows; None for one that it does not."""
    return value if math.isfinite(value) else None
