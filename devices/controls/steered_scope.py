"""A scope that a hand steers without an arm: keys, mouse, gamepad, 3D mouse."""

import math
from collections.abc import Callable
from typing import Protocol

from devices.controls.fulcrum import FulcrumControl
from devices.controls.steering import Steering, SteeringEvents
from devices.port import Clock, DeviceError, DeviceReason
from devices.pose import Pose
from devices.source import PulledSource
from system import UserError

RATE_HZ = 100.0
"""As often as an arm is asked."""

STALL_S = 0.5
"""A reader that comes later than this stood still: nobody steers by a picture that
stands."""

KEPT_S = 0.25
"""So much of the time before a late look is still flown; strokes of the rest are
forgotten, keys that are still held count from then on."""


def _never() -> bool:
    """Return False: what is not told apart moves at all times."""
    return False


class ScopeController(Protocol):
    """A device in somebody's hand that must be asked what happened to it."""

    def poll(self, steering: SteeringEvents) -> None:
        """Pass on what happened since the last time; DeviceError if it went away."""
        ...

    def close(self) -> None:
        """Let go of the device; harmless when repeated."""
        ...


class SteeredArm(PulledSource):
    """Poses of a scope that pivots about the nostril; see ``QueuedSource``.

    Where nobody reads for `STALL_S` the poses' time stands, so that what was steered
    blindly is not flown at once; `read` tells so, once, by DeviceError(OVERRUN).
    The frame of the poses is that of the fulcrum. x and y of the tip frame carry the
    roll: y is where the light post is.
    """

    def __init__(
        self,
        control: FulcrumControl,
        steering: Steering,
        handset: ScopeController | None = None,
        *,
        rate_hz: float = RATE_HZ,
        clock: Clock | None = None,
        events: SteeringEvents | None = None,
        is_still: Callable[[], bool] = _never,
    ) -> None:
        """Begin at the control's frame.

        events: takes what happens to the handset, the steering itself if None.
        is_still: while it says so nothing moves, whatever was asked for.
        """
        super().__init__("the steered scope", clock)
        if not rate_hz > 0.0:
            raise UserError(f"rate_hz must be positive, got {rate_hz}")
        self._control = control
        self._steering = steering
        self._handset = handset
        self._events = steering if events is None else events
        self._is_still = is_still
        self._rate_hz = rate_hz
        self._start_s = self._clock.now()
        self._ticks = 0
        self._stood_s = 0.0

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise as ``PulledSource.read``, and after a stall."""
        self._advance(self._clock.now())
        stood_s, self._stood_s = self._stood_s, 0.0
        if stood_s > 0.0:
            raise DeviceError(
                DeviceReason.OVERRUN,
                f"The flight stood still for {stood_s:.1f} s; what was steered "
                "meanwhile is left out.",
            )
        return super().read(timeout_s)

    def close(self) -> None:
        """End the source and let go of the handset; harmless when repeated."""
        super().close()
        if self._handset is not None:
            self._handset.close()

    def _advance(self, now_s: float) -> float:
        with self._lock:
            if self._handset is not None and not self._is_closed:
                try:
                    self._handset.poll(self._events)
                except DeviceError as error:
                    # What was measured before is read before this is told.
                    self._queue.fail(error)
                    return math.inf
            late_s = now_s - self._due_s()
            if late_s > STALL_S and not self._is_closed:
                self._stand_still(late_s - KEPT_S)
            return super()._advance(now_s)

    def _stand_still(self, stood_s: float) -> None:
        """Take note of what is held now; no pose belongs to the time that passed."""
        from_s = self._tick_s(self._ticks)
        self._start_s += stood_s
        self._steering.step(from_s, self._tick_s(self._ticks))
        self._control.let_go()
        if self._ticks:
            # before the first pose nothing was flown that could stand
            self._stood_s += stood_s

    def _due_s(self) -> float:
        return self._tick_s(self._ticks + 1)

    def _make(self, due_s: float) -> Pose:
        before = self._tick_s(self._ticks)
        self._ticks += 1
        demand, buttons = self._steering.step(before, due_s)
        if self._is_still():
            self._control.let_go()
        else:
            self._control.advance(1.0 / self._rate_hz, demand)
        return Pose(
            time_s=self._ticks / self._rate_hz,
            host_time_s=due_s,
            device_from_tip=self._control.frame(),
            buttons=buttons,
        )

    def _tick_s(self, number: int) -> float:
        # Multiplied, not added up: after hours the ticks still come at even times.
        return self._start_s + number / self._rate_hz
