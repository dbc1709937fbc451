"""How long a worker may be silent before its job is taken over.

A claim on a job is a lease that its worker's heartbeat renews.
"""

import time
from collections.abc import Callable, Container
from dataclasses import dataclass

LEASE_S = 15.0
"""Silence after which a worker counts as dead; heartbeats come every 2 s. Take 60 on a
disk that machines share over a network, which may show a file late."""


@dataclass(frozen=True, slots=True)
class _Sign:
    """Remember a heartbeat, since when it stands, and whether it was seen to change."""

    heartbeat: tuple[int, int]
    since_s: float
    has_changed: bool


class LeaseWatch:
    """Judge silence by one's own clock since a heartbeat was last seen to change.

    Clocks of two machines are never compared: a job's time begins when this object
    first looks at it.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._signs: dict[str, _Sign] = {}

    def is_stale(self, job_id: str, heartbeat: tuple[int, int], lease_s: float) -> bool:
        """Return whether a heartbeat, attempt and count, has stood still for `lease_s`.

        Look again and again: a change between two looks is a sign of life.
        """
        now = self._clock()
        sign = self._signs.get(job_id)
        if sign is None or sign.heartbeat != heartbeat:
            self._signs[job_id] = _Sign(heartbeat, now, sign is not None)
            return False
        return now - sign.since_s > lease_s

    def was_alive(self, job_id: str) -> bool:
        """Return whether the heartbeat was ever seen to change."""
        sign = self._signs.get(job_id)
        return sign is not None and sign.has_changed

    def forget(self, job_id: str) -> None:
        """Begin anew with a job."""
        self._signs.pop(job_id, None)

    def keep_only(self, jobs: Container[str]) -> None:
        """Forget all other jobs, so that memory does not grow with jobs that ended."""
        self._signs = {j: sign for j, sign in self._signs.items() if j in jobs}
