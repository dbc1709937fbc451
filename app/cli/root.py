"""The command line's root: its commands, and the options that several of them share."""

from functools import partial
from importlib.metadata import version
from typing import Annotated, Literal

from cyclopts import App, Group, Parameter
from cyclopts.validators import Number

from app.cli.overview import COMMANDS, command_name

app = App(
    name="paravol",
    help="Endoscopic sinus surgery trainer: fly, replay, snapshot, measure.",
    version=partial(version, "paravol-ess"),
    # No --empty-fault and the like: who wants none leaves the option out.
    default_parameter=Parameter(negative_iterable=()),
    # Ctrl-C is told by main(), which also sets the exit status.
    suppress_keyboard_interrupt=False,
)

GROUPS = {name: Group(name, sort_key=place) for place, name in enumerate(COMMANDS, 1)}
for _name, _commands in COMMANDS.items():
    for _module, _function in _commands:
        app.command(
            f"app.cli.{_module}:{_function}",
            name=command_name(_function),
            group=GROUPS[_name],
        )

FLATTENED = Parameter(name="*", negative="")
"""For a dataclass whose fields are options of the command."""

Threads = Annotated[
    int,
    Parameter(
        help="Rendering threads; 0 takes what the machine has.",
        validator=Number(gte=0),
    ),
]
Ranks = Annotated[
    int,
    Parameter(
        help="MPI processes; 1 renders without MPI.", validator=Number(gte=1, lte=1024)
    ),
]
UsualRanks = Annotated[
    int | None,
    Parameter(
        help="MPI processes; 1, the usual, renders without MPI, on threads.",
        validator=Number(gte=1, lte=1024),
    ),
]
Seed = Annotated[int, Parameter(validator=Number(gte=0, lte=2**63 - 1))]
Size = Annotated[
    int,
    Parameter(
        help="Width and height of the picture in pixels.",
        validator=Number(gte=16, lte=8192),
    ),
]
ScenarioName = Annotated[
    str,
    Parameter(help="Name of a bundled scenario, or a .toml file of your own."),
]
Flag = Annotated[bool, Parameter(negative="")]
Json = Annotated[bool, Parameter(negative="", help="Print the result as JSON.")]
Place = tuple[float, float, float]


Oversubscribe = Annotated[
    bool,
    Parameter(negative="", help="Start all --ranks, more than there are processors."),
]


@app.command(name="--install-completion", group=GROUPS["Machine"])
def install_completion(
    shell: Literal["bash", "zsh", "fish", "powershell"] | None = None,
) -> None:
    """Install completion of commands and options for your shell.

    Parameters
    ----------
    shell
        The shell; the one this command runs in when left out.
    """
    print(f"Installed {app.install_completion(shell=shell)}; start a new shell.")


def rank_count(asked: int, *, oversubscribe: bool) -> int:
    """Return at most a rank a processor; print a line where more are asked for.

    More only wait for one another: 99 on two processors take a hundred times as long.
    """
    import sys

    from system import usable_cores

    there = usable_cores()
    if asked <= there or oversubscribe:
        return asked
    print(
        f"{asked} ranks would share {there} processor{'s'[: there - 1]} and wait for "
        f"one another; taking {there} (--oversubscribe takes all {asked}).",
        file=sys.stderr,
    )
    return there


def thread_count(asked: int) -> int:
    """Turn the option into a number of threads."""
    from system import usable_cores

    return asked or usable_cores()
