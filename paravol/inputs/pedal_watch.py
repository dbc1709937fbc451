"""Foot pedals in flight: debounced, told, and passed by."""

from collections.abc import Callable
from dataclasses import dataclass, field

from devices import Pose
from devices.controls.pedals import Button, ButtonEvent, Debouncer
from paravol.flight import Aim
from scenarios import Sample
from scenarios.bundle import EventRecord

NAMES = {Button.RIGHT_PEDAL: "right pedal", Button.LEFT_PEDAL: "left pedal"}


@dataclass(slots=True)
class PedalWatch:
    """Pass samples on and tell of every press and release, with its sample."""

    aim: Aim
    on_event: Callable[[ButtonEvent, Sample], None]
    _debouncer: Debouncer = field(default_factory=Debouncer)

    def complete(self, pose: Pose) -> Sample:
        """Complete a pose; tell what its buttons say."""
        sample = self.aim.complete(pose)
        for event in self._debouncer.feed_pose(pose):
            self.on_event(event, sample)
        return sample


def record_of(event: ButtonEvent, time_s: float) -> EventRecord:
    """Describe an edge for the recording; time_s is that of the session."""
    return EventRecord(
        time_s, "button", f"{NAMES[event.button]} {'down' if event.is_down else 'up'}"
    )
