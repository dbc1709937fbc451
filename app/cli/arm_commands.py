"""Commands about a real arm: home it, register it.

As in app/cli/commands.py, nothing heavy is imported before a command runs.
"""

from dataclasses import dataclass
from pathlib import Path

from cyclopts import Parameter

from app.cli.root import DEVICES, Flag, Json, ScenarioName, Seed, app


@app.command(group=DEVICES)
def home(*, device: str, yes: Flag = False, json: Json = False) -> int:
    """Home an arm that stands in its rest position.

    Asks before it does: an arm that is homed elsewhere measures wrongly without a
    word.

    Parameters
    ----------
    device
        Serial port of a MicroScribe, such as /dev/ttyUSB0.
    yes
        The arm is in its rest; do not ask.
    """
    from app.cli.home_command import run_home

    return run_home(device, yes=yes, as_json=json)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class RegisterOptions:
    """Options of a registration, as they were typed.

    Parameters
    ----------
    device
        Serial port of a MicroScribe, such as /dev/ttyUSB0, or socket://host:port.
    emulated
        Let an emulated arm go all the way by itself; its true errors are shown.
    out
        The .json file to write; a .tfm for ITK and 3D Slicer lands beside it.
    pivot
        Calibrate the tip first; --no-pivot takes the tip that the arm states.
    trace
        Refine on a traced patch of skin; --no-trace leaves the landmarks alone.
    target
        Landmark at which the error is shown; the sinuses when left out.
    seed
        Where the emulated arm stands and how its hand shakes.
    yes
        Write the file without asking.
    input
        Another tracker instead of an arm: igtl:HOST:PORT[:TOOL].
    """

    scenario: ScenarioName = "first_flight"
    device: str | None = None
    emulated: Flag = False
    out: Path = Path("registration.json")
    pivot: bool = True
    trace: bool = True
    target: tuple[str, ...] = ()
    seed: Seed = 1
    yes: Flag = False
    input: str | None = None


@app.command(group=DEVICES)
def register(
    *, options: RegisterOptions = RegisterOptions(), json: Json = False
) -> int:
    """Register an arm: turn the tip, touch the landmarks, trace the skin."""
    from app.cli.register_command import run_register

    return run_register(options, as_json=json)
