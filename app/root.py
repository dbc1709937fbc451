"""The command line's root: its name, and the options that several commands share."""

from typing import Annotated

from cyclopts import App, Parameter

app = App(
    name="paravol",
    help="Endoscopic sinus surgery trainer: fly, replay, snapshot, measure.",
    help_epilogue="Start with: paravol demo",
    # Ctrl-C is told by main(), which also sets the exit status.
    suppress_keyboard_interrupt=False,
)

Threads = Annotated[
    int, Parameter(help="Rendering threads; 0 takes what the machine has.")
]
Json = Annotated[bool, Parameter(negative="", help="Print the result as JSON.")]
Place = tuple[float, float, float]


def thread_count(asked: int) -> int:
    """Turn the option into a number of threads."""
    import os

    if asked < 0:
        raise ValueError(f"--threads must not be negative, got {asked}")
    return asked or len(os.sched_getaffinity(0))
