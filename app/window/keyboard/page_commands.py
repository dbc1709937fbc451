"""What a page does when an action is asked for, by whatever: a key, or a button."""

from collections.abc import Callable
from dataclasses import dataclass

from app.window.keyboard.actions import Act


@dataclass(frozen=True, slots=True)
class Command:
    """Describe what is done.

    press: when the key or button goes down. release: when it goes up, or is lifted
    unseen; None where it does not count how long it is held. repeats: `press` is done
    again and again meanwhile.
    """

    press: Callable[[], object]
    release: Callable[[], object] | None = None
    repeats: bool = False


Commands = dict[Act, Command]
"""What can be done on a page; what is not in it is not the page's."""

Notify = Callable[[str, str], None]
"""Says a line and what it means."""
