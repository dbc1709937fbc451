"""One thing found out about the machine or an arm."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """State one thing about the machine.

    value: how it stands. is_missing: it is required and not there.
    remedy: what to do about it, empty when nothing is. why: it matters to a flight.
    """

    name: str
    value: str
    is_missing: bool = False
    remedy: str = ""
    why: str = ""
