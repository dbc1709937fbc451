"""Rumble of a gamepad, by Linux's force feedback.

The layout of effects and requests is the kernel's published interface to programs
(linux/input.h, "Force feedback for Linux"). The kernel ends an effect after its own
length and forgets it when its file is closed, so that a pad falls still even where
this program is stopped or killed.
"""

import os
import struct
import threading
import time
from collections.abc import Callable
from pathlib import Path

from devices.controls.linux_input import EVENT, bits, request_number

EV_FF, FF_RUMBLE = 0x15, 0x50

_MOST_EFFECTS = 0x80

# type, id, direction, trigger (2), replay: length and delay (2); then a union, whose
# largest member ends with a pointer and is aligned as one. Rumble is its first two
# values: strong and weak motor.
_EFFECT = struct.Struct("@HhHHHHH0P9HIP0P")
_NEW = -1

_SET_EFFECT = request_number(1, 0x80, _EFFECT.size)
_GET_EFFECTS = request_number(2, 0x20 + EV_FF, _MOST_EFFECTS // 8)

LENGTH_MS = 300
"""An effect ends by itself after this time: who is not heard of any more presses no
more."""

RENEWED_S = 0.15
"""A press that does not change is renewed so often."""

PULSE_MS = 120

WEAKEST = 0.15
"""Share of full strength at which a pad's motor begins to turn."""

STEP = 0.02
"""A change of strength below this is not felt."""


class Rumble:
    """Let a pad rumble; does nothing any more once the pad refuses.

    May be called by any thread.
    """

    def __init__(self, file: int, now_s: Callable[[], float] = time.monotonic) -> None:
        """Take over a file of the pad, opened for writing."""
        self._file = file
        self._now_s = now_s
        self._effect = _NEW
        self._strength = 0.0
        self._set_s = 0.0
        self._pulse_until_s = 0.0
        self._lock = threading.Lock()

    def follow(self, strength: float) -> None:
        """Rumble as strongly as this, 0 to 1, until the next call; 0 stops.

        A pulse that has begun is left to end.
        """
        strength = min(max(strength, 0.0), 1.0) if strength == strength else 0.0
        with self._lock:
            now = self._now_s()
            if now < self._pulse_until_s:
                return
            is_new = abs(strength - self._strength) >= STEP
            is_new |= (strength == 0.0) != (self._strength == 0.0)
            if is_new or (strength > 0.0 and now >= self._set_s + RENEWED_S):
                self._play(strength, LENGTH_MS, now)

    def pulse(self) -> None:
        """Rumble at full strength for `PULSE_MS`."""
        with self._lock:
            now = self._now_s()
            self._pulse_until_s = now + PULSE_MS / 1e3
            self._play(1.0, PULSE_MS, now)

    def stop(self) -> None:
        """Be still at once."""
        with self._lock:
            self._pulse_until_s = 0.0
            if self._strength > 0.0:
                self._play(0.0, LENGTH_MS, self._now_s())

    def close(self) -> None:
        """Be still and let go of the pad; harmless when repeated."""
        self.stop()
        with self._lock:
            self._close()

    def _play(self, strength: float, length_ms: int, now_s: float) -> None:
        """Hand an effect to the kernel, and play or stop it."""
        if self._file < 0:
            return
        # Imported here: the module is there on Unix only.
        import fcntl

        motor = 0.0 if strength == 0.0 else WEAKEST + (1.0 - WEAKEST) * strength
        try:
            if strength > 0.0:
                # strong and weak motor alike: which is felt differs from pad to pad
                union = (round(0xFFFF * motor), round(0xFFFF * motor), *[0] * 9)
                effect = _EFFECT.pack(
                    *(FF_RUMBLE, self._effect, 0, 0, 0, length_ms, 0), *union
                )
                answer = fcntl.ioctl(self._file, _SET_EFFECT, effect)
                self._effect = _EFFECT.unpack(answer)[1]
            if self._effect != _NEW:
                event = EVENT.pack(0, 0, EV_FF, self._effect, int(strength > 0.0))
                os.write(self._file, event)
        except BlockingIOError:
            return
        except OSError:
            # unplugged, or it takes no effect: a pad that is still disturbs nobody
            self._close()
            return
        self._strength, self._set_s = strength, now_s

    def _close(self) -> None:
        file, self._file = self._file, -1
        if file >= 0:
            os.close(file)


def open_rumble(path: Path) -> Rumble | None:
    """Return the rumble of an input device; None where it has none, or may not be
    written to."""
    try:
        import fcntl
    except ImportError:
        return None
    try:
        file = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
    except OSError:
        return None
    try:
        answer = fcntl.ioctl(file, _GET_EFFECTS, bytes(_MOST_EFFECTS // 8))
    except OSError:
        answer = b""
    if FF_RUMBLE in bits(answer):
        return Rumble(file)
    os.close(file)
    return None
