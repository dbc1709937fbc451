"""A press: the poses that were measured while a pedal was down."""

from dataclasses import dataclass, field

from devices.pose import Pose, PoseFlag

# A contact chatters for 2-10 ms when it opens and when it closes.
CHATTER_S = 0.03

# A foot needs at least a tenth of a second.
SHORTEST_S = 0.1


@dataclass(slots=True)
class PressCollector:
    """Turn a stream of poses into presses of one pedal.

    Interruptions shorter than 0.03 s belong to the press, presses shorter than 0.1 s
    are dropped; so are poses that may be wrong.
    """

    pedal: int
    _held: list[Pose] = field(default_factory=list)

    @property
    def held(self) -> int:
        """Get the number of poses of the press that is going on."""
        return len(self._held)

    def feed(self, pose: Pose) -> list[Pose] | None:
        """Take the next pose; return the press that ended with it, if one did."""
        if pose.buttons & self.pedal:
            if not pose.flags & (PoseFlag.JUMP | PoseFlag.SUSPECT):
                self._held.append(pose)
            return None
        if not self._held or pose.time_s - self._held[-1].time_s < CHATTER_S:
            return None
        held, self._held = self._held, []
        if held[-1].time_s - held[0].time_s < SHORTEST_S:
            return None
        return held
