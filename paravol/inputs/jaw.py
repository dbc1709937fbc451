"""Jaws that a pedal closes, and a spring opens."""

CLOSING_S, OPENING_S = 0.25, 0.35
"""Times in which jaws close and open."""


class Jaw:
    """Follow a pedal in the samples' time."""

    def __init__(self) -> None:
        """Begin open."""
        self._closed = 0.0
        self._last_s: float | None = None

    def at(self, time_s: float, is_working: bool) -> float:
        """Return how far the jaws are closed, 0 open to 1; is_working: pedal is down.

        Times that go back move nothing.
        """
        elapsed_s = 0.0 if self._last_s is None else max(time_s - self._last_s, 0.0)
        self._last_s = time_s
        if is_working:
            self._closed = min(self._closed + elapsed_s / CLOSING_S, 1.0)
        else:
            self._closed = max(self._closed - elapsed_s / OPENING_S, 0.0)
        return self._closed
