"""The options of `paravol train`, with their help."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from app.cli.root import FLATTENED, Flag, ScenarioName, Threads

MostSize = Annotated[
    int,
    Parameter(
        help="Largest width and height of the picture in pixels. It follows the "
        "window, and is less where frames would be late.",
        validator=Number(gte=16, lte=8192),
    ),
]


@dataclass(frozen=True, kw_only=True, slots=True)
class DeviceOptions:
    """How devices are placed, and what moves the tool."""

    registration: Path | None = None
    """File of `paravol register`, made since the arm was switched on, or of a
    tracker."""
    roll: str | None = None
    """Who knows the roll of the scope in the arm at --device: horizon (level, the arrow
    keys turn it), encoder (a sixth joint) or igtl:HOST:PORT[:TOOL]."""
    instrument: str | None = None
    """A second device for the tool: mouse, gamepad[:FILE or :NUMBER],
    igtl:HOST:PORT[:TOOL], arm:PORT or recording:FILE. Without it the tool is carried
    before the lens, and the key H holds the scope and moves the tool."""
    instrument_registration: Path | None = None
    """File of `paravol register` for the arm or tracker that moves the tool."""
    instrument_side: str | None = None
    """Nostril that a steered tool passes, right or left; else that of the scope."""


ONE_DEVICE = DeviceOptions()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class TrainOptions:
    """Options of a flight in the window, as they were typed.

    Parameters
    ----------
    case
        Fly through a case folder, as import and phantom write, not a scenario.
    device
        Serial port of a MicroScribe, such as /dev/ttyUSB0.
    input
        Without an arm, fly with mouse (and keyboard, the default), gamepad,
        recording:FILE, igtl:HOST:PORT or emulator, which flies the scenario's path.
    stream_igtl
        Stream tool poses by OpenIGTLink at this [HOST:]PORT.
    haptics
        What pushes back: none, emulated (a force device that the chosen input holds)
        or force-dimension (one on this machine, which steers by itself).
    haptics_fault
        Let the emulated force device fail: NAME[@SECONDS[+DURATION]] with stuck,
        saturated, silent, lying or unplugged, such as silent@10+1.
    record
        Record the session into this folder, NAME.paravol, for good. Without it the
        newest sessions are kept below the user's data directory, 1 GB of them.
    instructor_page
        Show the flight on a read-only web page to an instructor at this machine: the
        port, 0 for any that is free. The address is printed.
    seconds
        Close the window by itself after this time.
    screenshot
        Save a picture of the window when it closes.
    sound
        Tones tell how near the nearest hazard is and how hard a tool presses; the key
        U switches them, too.
    volume
        Of the sound, 0 to 1.
    patient
        Seed of the patient, the same in each attempt, as for an examination. Without
        it attempts have the exercise's own, one after the other.
    trainee
        A name that you made up, under which paravol progress keeps the session. None
        is needed.
    no_store
        Leave the session out of paravol progress.
    theme
        Colours of the window: dark, light or high-contrast. Without it the theme that
        was chosen last; F2 chooses another.
    font_scale
        Size of the window's texts, 0.8 to 1.5; without it as chosen last.
    """

    scenario: ScenarioName | None = None
    case: Path | None = None
    device: str | None = None
    input: str | None = None
    stream_igtl: str | None = None
    devices: Annotated[DeviceOptions, FLATTENED] = ONE_DEVICE
    haptics: str = "none"
    haptics_fault: str | None = None
    size: MostSize = 1024
    threads: Threads = 0
    record: Path | None = None
    instructor_page: Annotated[
        int | None, Parameter(validator=Number(gte=0, lte=65535))
    ] = None
    seconds: float | None = None
    screenshot: Path | None = None
    sound: Literal["on", "off"] = "on"
    volume: Annotated[float, Parameter(validator=Number(gte=0, lte=1))] = 1.0
    patient: Annotated[int | None, Parameter(validator=Number(gte=0, lt=2**31))] = None
    trainee: str = ""
    no_store: Flag = False
    theme: Literal["dark", "light", "high-contrast"] | None = None
    font_scale: Annotated[
        float | None, Parameter(validator=Number(gte=0.8, lte=1.5))
    ] = None


AS_USUAL = TrainOptions()
