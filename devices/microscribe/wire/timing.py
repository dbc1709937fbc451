"""How long to wait for an arm."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class LinkTiming:
    """How long to wait, in seconds."""

    between_sign_ons: float = 0.015
    """The arm needs this to look at what it heard."""
    per_rate: float = 1.0
    """The arm itself walks through seven rates."""
    forced_rate: float = 1.5
    """Per pass when only one rate is allowed."""
    silence: float = 0.05
    """Longer than any pause inside what an arm has to say."""
    surplus: float = 0.5
    """Sign-on echoes end by then."""
    begin: float = 3.0
    reply: float = 0.1
    """At least; a slow line is given three times its wire time."""
    string: float = 0.5
    block: float = 3.0
    settle: float = 0.015
    """Between the last command and closing the port."""
    extra_bytes: float = 0.0005
    """A doubled byte follows its packet by one byte time (0.09 ms at 115200)."""
    latency: float = 0.001
    """An arm thinks "just under a millisecond" before it answers a poll."""
