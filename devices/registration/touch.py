"""A touch: one point held with the stylus while the pedal is down."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from devices.pose import Pose, PoseFlag

MARK_PEDAL = 1

# A contact bounces for 2-10 ms and a foot needs at least a tenth of a second.
SHORTEST_S = 0.1

# Pressing the pedal shakes the hand; a median over the press forgives that, but a
# stylus that travels this far while it is down was not resting on anything.
LARGEST_TRAVEL_MM = 3.0


@dataclass(slots=True)
class TouchCollector:
    """Turn a stream of poses into touched points, (3,) mm in the device's frame.

    Presses shorter than 0.1 s are taken for bounce, presses in which the tip moved
    by more than 3 mm are counted in ``slipped`` and give no point.
    """

    pedal: int = MARK_PEDAL
    slipped: int = 0
    points_mm: list[NDArray[np.float64]] = field(default_factory=list)
    _pressed: list[Pose] = field(default_factory=list)

    def feed(self, pose: Pose) -> NDArray[np.float64] | None:
        """Take the next pose; return the point that its release completed, if any."""
        if pose.buttons & self.pedal:
            if not pose.flags & (PoseFlag.JUMP | PoseFlag.SUSPECT):
                self._pressed.append(pose)
            return None
        held, self._pressed = self._pressed, []
        if not held or held[-1].time_s - held[0].time_s < SHORTEST_S:
            return None
        tips = np.array([p.tip_mm for p in held])
        point: NDArray[np.float64] = np.median(tips, axis=0)
        if np.linalg.norm(tips - point, axis=1).max() > LARGEST_TRAVEL_MM:
            self.slipped += 1
            return None
        self.points_mm.append(point)
        return point
