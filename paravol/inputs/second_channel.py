"""What else is in hand beside a pose: scope, tool and pedals, joined to one sample."""

from collections.abc import Callable
from dataclasses import dataclass, field

from devices import Pose
from devices.controls.pedals import ButtonEvent, Debouncer
from paravol.inputs.instrument_controller import InstrumentController
from paravol.inputs.pose_completer import PoseCompleter
from paravol.inputs.scope_in_hand import ScopeInHand
from scenarios import Sample


def _unheard(*told: object) -> None:
    """Tell nobody."""


@dataclass(slots=True)
class SecondChannel:
    """Join each pose with all that is in hand at its time.

    channel: what the input itself knows beside its poses. on_pedal: hears of every
    press and release, with its sample. on_sample: hears of every sample, with its pose.
    """

    channel: PoseCompleter
    scope: ScopeInHand
    hand: InstrumentController
    on_pedal: Callable[[ButtonEvent, Sample], None] = _unheard
    on_sample: Callable[[Sample, Pose], None] = _unheard
    _debouncer: Debouncer = field(default_factory=Debouncer)

    def join(self, pose: Pose) -> Sample:
        """Return the sample of a pose."""
        sample = self.channel.complete(self.hand.take_turns(pose))
        sample = self.hand.hold(self.scope.turn(sample), pose)
        for event in self._debouncer.feed_pose(pose):
            self.on_pedal(event, sample)
        self.on_sample(sample, pose)
        return sample
