"""Jaws that a pedal closes, and a spring opens."""

CLOSING_S, OPENING_S = 0.25, 0.35
"""Times in which jaws close and open."""


class Jaw:
    """Follow a pedal in the samples' time."""

    def __init__(self, closed: float = 0.0) -> None:
        """Begin open, or closed by a share."""
        self._closed = closed
        self._last_s: float | None = None

    def at(self, time_s: float, is_working: bool, rest: float = 0.0) -> float:
        """Return how far the jaws are closed, 0 open to 1; is_working: pedal is down.

        rest: so far they are closed while it is up. Times that go back move nothing.
        """
        elapsed_s = 0.0 if self._last_s is None else max(time_s - self._last_s, 0.0)
        self._last_s = time_s
        end = 1.0 if is_working else rest
        if end > self._closed:
            self._closed = min(self._closed + elapsed_s / CLOSING_S, end)
        else:
            self._closed = max(self._closed - elapsed_s / OPENING_S, end)
        return self._closed
